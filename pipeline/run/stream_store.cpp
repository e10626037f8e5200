#include <algorithm>
#include <optional>
#include <utility>

#include "io/files/output_file.h"
#include "io/samples/spooled.h"
#include "io/tag/file.h"
#include "pipeline/encode/row_encoder.h"
#include "pipeline/encode/slices_ahead.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/encode_into.h"

namespace tagrid {
namespace {

class StreamStore : public BrickStore {
 public:
  StreamStore(const EncodeRun& run, const Resources& resources) : run_(run), resources_(resources) {}

  Reading reading(const VolumeSource& source) const override {
    return {source.traits().any_rows, source.traits().memory};
  }

  EarlierFindings begin(const ResolvedOptions&, const VolumeSource&) override { return {}; }

  bool take(const EncodeJob& job, const VolumeSource& source) override {
    const OutputFileOptions like = {.like = attributes_of(source.files().back())};
    file_ = std::make_unique<OutputFile>(run_.output, run_.overwrite, like);
    writer_.emplace(*file_, job.header);
    return true;
  }

  void encode(const EncodeJob& job, std::unique_ptr<VolumeSource>& source, EncodeResult& result) override {
    const CodingParameters& parameters = job.parameters();
    const bool spools = job.plan.spooled && !source->traits().any_rows;
    if (spools) source = spooled(std::move(source), resources_.spool);
    // Only programs give nothing but whole slices; they decode them while bricks are encoded.
    const std::int64_t layer = std::min(parameters.bricks().length(), parameters.dims.z);
    const std::int64_t count =
        source->traits().whole_slices ? slices_beside(parameters, job.plan, resources_, layer) : 0;
    result.memory += static_cast<std::uint64_t>(count) * source->slice_bytes();
    SlicesAhead ahead(*source, count);
    RowEncoder encoder(parameters, job.plan, [&](const Box& rows) { return ahead.read(rows); });
    ahead.stop_when(encoder.failed());
    const BrickRows all = BrickRows::all(parameters.bricks());
    encoder.encode(all, *writer_,
                   watch_for(run_.progress, sample_bytes(parameters.dims, parameters.type).value()));
    ahead.end();
    result.bytes_in = source->bytes_read();
    result.times_read += times_read(parameters, job.plan, {all}) + spools;
  }

  void look_at(SourceFiles& files, bool exact) override {
    look_at_contents(files, exact, resources_.threads);
  }

  void write_envelope(std::span<const std::byte> bytes) override { writer_->write_envelope(bytes); }

  void finish(EncodeResult& result) override {
    writer_->finish();
    result.index = writer_->index();
    result.file_bytes = file_->position();
    result.temporary = file_->temporary();
  }

  void commit() override { file_->commit(); }

 private:
  const EncodeRun& run_;
  Resources resources_;
  std::unique_ptr<OutputFile> file_;
  std::optional<TagWriter> writer_;
};

}  // namespace

std::unique_ptr<BrickStore> store_of_stream(const EncodeRun& run, const Resources& resources) {
  return std::make_unique<StreamStore>(run, resources);
}

}  // namespace tagrid
