#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "io/envelope/envelope.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/held_files.h"
#include "io/files/output_file.h"
#include "io/files/spool_file.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/loss.h"
#include "io/parity/parity.h"
#include "io/samples/file_samples.h"
#include "io/samples/stored_bits.h"
#include "io/system/files.h"
#include "io/tag/file.h"
#include "io/text/text.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/encode/graph.h"
#include "pipeline/encode/overviews.h"
#include "pipeline/memory/parity.h"
#include "pipeline/memory/plan.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "pipeline/slices/slices_ahead.h"

namespace tagrid {
namespace {

bool keeps_files(const EncodeRun& run) { return run.keep_files && !run.options.strip; }

// Memory of the names and places of source files, which are watched and kept, besides the source's own.
std::uint64_t memory_of_files(const EncodeRun& run, const VolumeSource& input) {
  return (run.verified ? 2 : 1) * UnchangedFiles::memory(input.files()) +
         (keeps_files(run) ? memory_of_source_files(input.facts()) : 0);
}

// How the input will be read when the file is compared with it; nothing if it will not be.
std::optional<Comparing> original_access(const EncodeRun& run, const VolumeSource& input) {
  if (!run.verified) return std::nullopt;
  const std::uint64_t compared = memory_of_files(envelope_size(input.facts()));
  return Comparing{{input.traits().any_rows, input.traits().memory + memory_of_files(run, input) + compared},
                   smallest_memory_of_verifying};
}

// A kept file may have been changed by a program that set its time back. A comparison would show that.
void warn_of_touched(const EncodeRun& run, const UnchangedFiles& files, EncodeResult& result) {
  if (run.verified || !keeps_files(run)) return;
  if (const std::string touched = files.touched(); !touched.empty())
    result.warnings.push_back(
        touched +
        ": its metadata changed while it was read (ctime: a link, permissions, or a time that was set back); "
        "compare the .tag file with the original");
}

// Fails early if the output may not be written. A run that was interrupted just before or after its end may have
// written it already: a run that continues checks later.
void check_early(const EncodeRun& run) {
  // Parity is made from the finished file, which is read again.
  if (run.options.parity && !is_regular_output(run.output))
    throw UsageError(
        Sentence{"{}: {} needs an output that can be read again; write to a file, or protect it later",
                 {shown_output(run.output), setting::parity}});
  if (!run.resume) check_output(run.output, run.overwrite);
}

class StreamStore : public BrickStore {
 public:
  StreamStore(const EncodeRun& run, const Resources& resources) : run_(run), resources_(resources) {}

  Reading reading(const VolumeSource& source) const override {
    return {source.traits().any_rows, source.traits().memory};
  }

  EarlierFindings begin(const ResolvedOptions&, const VolumeSource&) override { return {}; }

  Made take(const EncodeJob& job, const VolumeSource& source) override {
    const OutputFileOptions like = {.like = attributes_of(source.files().back())};
    file_ = std::make_unique<OutputFile>(run_.output, run_.overwrite, like);
    writer_.emplace(*file_, job.header);
    return Made::no;
  }

  void encode(const EncodeJob& job, std::unique_ptr<VolumeSource>& source, EncodeResult& result) override {
    const bool spools = job.plan.spooled && !source->traits().any_rows;
    if (spools) source = spooled(std::move(source), resources_.spool);
    const VolumeInfo& info = source->info();
    watch_.emplace(run_.progress, sample_bytes(info.dims, info.type).value());
    const auto first = info.volumes > 1 ? one_of_volumes(*source, 0) : nullptr;
    overviews_.emplace(encode_bricks(job, first ? *first : *source, *writer_, result));
    result.bytes_in = source->bytes_read();
    result.times_read +=
        times_read(job.parameters(), job.plan, {BrickRows::all(job.parameters().bricks())}) + spools;
  }

  void encode_others(const EncodeJob& job, VolumeSource& source, EncodeResult& result) override {
    EncodeJob of_volume = job;
    TagHeader& header = of_volume.header;
    header.volumes = 1;
    for (int number = 1; number < job.header.volumes; ++number) {
      const auto volume = one_of_volumes(source, number);
      const Metadata& metadata = volume->info().metadata;
      header.metadata = run_.options.strip ? stripped(metadata) : metadata;
      SpoolFile encoded = SpoolFile::in(folder_of_sums(), run_.output);
      SpoolSink sink(encoded);
      TagWriter writer(sink, header);
      encode_bricks(of_volume, *volume, writer, result).write(writer, unwatched_);
      writer.finish();
      total_.add(writer.index().total);
      writer_->write_member(volume_kind, static_cast<std::uint32_t>(number), encoded.size(),
                            [&](const PassBytes& pass) {
                              encoded.read_back([&](std::span<std::byte> bytes) { pass(bytes); });
                            });
    }
    result.bytes_in = source.bytes_read();
  }

  void look_at(SourceFiles& files, bool exact) override {
    look_at_contents(files, exact, resources_.threads);
  }

  void write_envelope(std::span<const std::byte> bytes) override { writer_->write_envelope(bytes); }

  void finish(EncodeResult& result) override {
    if (overviews_) overviews_->write(*writer_, unwatched_);
    writer_->finish();
    result.index = writer_->index();
    result.index.total.add(total_);
    result.file_bytes = end_with_parity(*file_, file_->position(), run_.options.parity, resources_);
    result.temporary = file_->temporary();
  }

  void commit() override { file_->commit(); }

 private:
  std::string folder_of_sums() const { return spool_folder(resources_.spool, run_.output); }

  /// Encodes the bricks of a volume. Returns its overviews, which are not written yet.
  OverviewsOfStream encode_bricks(const EncodeJob& job, VolumeSource& volume, TagWriter& writer,
                                  EncodeResult& result) {
    const CodingParameters& parameters = job.parameters();
    // Only programs give nothing but whole slices; they decode them while bricks are encoded.
    const std::int64_t layer = std::min(parameters.bricks().length(), parameters.dims.z);
    const std::int64_t count =
        volume.traits().whole_slices ? slices_beside(parameters, job.plan, resources_, layer) : 0;
    result.memory =
        std::max(result.memory, job.plan.memory + static_cast<std::uint64_t>(count) * volume.slice_bytes());
    SlicesAhead slices(volume, count);
    Resources resources = resources_;
    resources.spool = folder_of_sums();
    OverviewsOfStream overviews(job.header, job.overviews, resources, run_.output);
    tagrid::encode(job, BrickRows::all(parameters.bricks()), slices, writer, *watch_, overviews.sums());
    return overviews;
  }

  const EncodeRun& run_;
  Resources resources_;
  std::unique_ptr<OutputFile> file_;
  std::optional<TagWriter> writer_;
  std::optional<OverviewsOfStream> overviews_;
  Statistics total_;                    // of the other volumes
  std::optional<ProgressWatch> watch_;  // of all volumes
  Watch unwatched_;
};

/// What users should know about bits that do not belong to samples; "" if that is nothing.
std::string about_spare_bits_of(const SourceFiles& files) {
  for (const EnvelopeFile& file : files.files)
    for (const SlicesInFile& slices : file.slices)
      if (slices.spare == SpareBits::kept) return about_spare_bits(file.name, slices.run.stored.bits);
  return "";
}

/// Throws UsageError, as for every other output that exists, unless it is the result of this run.
void require_earlier_result(const EncodeRun& run, const EncodeJob& job, const VolumeSource& volume,
                            const Resources& resources) {
  try {
    require_result(run, job, volume, resources);
  } catch (const BrokenInput& broken) {
    throw UsageError(fmt::format("{}: already exists, and is not what this run would write ({})", run.output,
                                 broken.what()),
                     Problem::output_exists);
  }
}

/// Gives the file its name if the source still exists, unchanged. Otherwise, a run that removes
/// originals may have verified the file that now has this name, and removed the source. That file
/// is then the only copy and must not be replaced.
struct LockedCommit {
  std::shared_ptr<BrickStore> store;
  std::string output;
  UnchangedFiles source;
  std::function<void()> before_name;

  void commit() const {
    std::optional<OutputLock> lock;
    if (is_regular_output(output)) lock.emplace(file_of_link(output));
    source.require();
    if (before_name) before_name();
    store->commit();
  }
};

// Writes the envelope of a source if `keep`, and if the source allows it.
void keep_source_files(const VolumeSource& source, bool exact, bool keep, BrickStore& store,
                       EncodeResult& result) {
  result.why_not_restorable = "only the samples were wanted";
  if (!keep) return;
  SourceFiles files = source_files(source.facts());
  result.warnings.insert(result.warnings.end(), files.warnings.begin(), files.warnings.end());
  if (files.why_not.empty()) {
    store.look_at(files, exact);
    if (std::string about = about_spare_bits_of(files); !about.empty())
      result.warnings.push_back(std::move(about));
    write_envelope(files, [&](std::span<const std::byte> bytes) { store.write_envelope(bytes); });
    result.times_read += times_read_for_envelope(files, exact);
  }
  result.why_not_restorable = files.why_not_restorable();
}

}  // namespace

FinishedEncode encode_into(std::shared_ptr<BrickStore> store, const EncodeRun& run,
                           const Resources& resources) {
  check_early(run);
  std::unique_ptr<VolumeSource> volume = open_volume(run.input, run.source);
  for (const std::string& file : volume->files()) refuse_same_file(file, run.output);
  const UnchangedFiles files(volume->files());
  const ResolvedOptions options = in_samples(run.options, volume->facts());
  // Checked before anything is read: a limit that cannot be kept is reported at once.
  const auto [any_rows, memory] = store->reading(*volume);
  const std::uint64_t parity_memory =
      run.options.parity ? least_memory_of_parity(*sample_bytes(volume->info().dims, options.parameters.type),
                                                  *run.options.parity)
                         : 0;
  // A view of rows has a slice.
  const std::uint64_t of_view =
      look_of(options) >= Look::a_few_rows && volume->traits().whole_slices ? volume->slice_bytes() : 0;
  const auto plan_for = [&, any_rows = any_rows, besides = memory + memory_of_files(run, *volume) + of_view](
                            const CodingParameters& parameters) {
    return plan_encoding(parameters, resources, any_rows,
                         {.besides = besides,
                          .sums = !options.overviews.empty(),
                          .verified = original_access(run, *volume),
                          .afterwards = parity_memory});
  };
  const EncodePlan plan = plan_for(options.parameters);
  const EarlierFindings earlier = store->begin(options, *volume);
  EncodeResult result;
  result.memory = plan.memory;
  if (run.options.parity)
    result.memory = std::max(
        result.memory, std::min(parity_memory + usual_parity_memory, resources.memory.value_or(UINT64_MAX)));
  const Look look = look_of(options, earlier);
  const bool has_copy = needs_copy(volume->traits(), look, resources);
  if (has_copy)
    volume = copied(std::move(volume), spool_folder(resources.spool, "-"), resources, plan.memory,
                    run.before_copy);
  std::unique_ptr<VolumeSource> view;
  if (look >= Look::a_few_rows && !volume->traits().any_rows) {
    // With all slices of a layer of bricks, none is decoded twice in one pass.
    const std::int64_t layer = std::min(options.parameters.bricks().length(), options.parameters.dims.z);
    const std::int64_t kept =
        look == Look::a_few_rows ? 0 : slices_beside(options.parameters, plan, resources, layer);
    result.memory =
        std::max(result.memory, plan.memory + static_cast<std::uint64_t>(kept) * volume->slice_bytes());
    view = view_of_rows(*volume, kept);
  }
  EncodeJob job = settle(options, plan, view ? *view : *volume, run.searching, earlier);
  view.reset();
  // A bound that was found has smaller bricks than a transform would have.
  if (job.parameters().brick_edge != options.parameters.brick_edge) job.plan = plan_for(job.parameters());
  result.header = job.header;
  result.reason_of_bound = job.reason_of_bound;
  result.times_read = job.times_read + has_copy;
  result.warnings = all_warnings(volume->facts());
  result.missing_of_voxel_size = volume->facts().missing_of_voxel_size;
  if (!job.doubt_of_bound.empty()) result.warnings.push_back(volume->name() + ": " + job.doubt_of_bound);
  result.lossy_source = volume->info().metadata.text_of(lossy_source_key);
  const Made made = store->take(job, *volume);
  if (made == Made::no) {
    store->encode(job, volume, result);
    keep_source_files(*volume, job.parameters().is_exact(), keeps_files(run), *store, result);
    if (job.header.volumes > 1) store->encode_others(job, *volume, result);
    // Samples and other bytes must be those of the same files.
    files.require();
    warn_of_touched(run, files, result);
  } else if (made == Made::in_doubt) {
    require_earlier_result(run, job, *volume, resources);
    result.was_complete = true;
  }
  store->finish(result);
  return {std::move(result),
          std::make_shared<LockedCommit>(LockedCommit{std::move(store), run.output, files, run.before_name})};
}

std::unique_ptr<BrickStore> store_of_stream(const EncodeRun& run, const Resources& resources) {
  return std::make_unique<StreamStore>(run, resources);
}

}  // namespace tagrid
