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
#include "pipeline/parts/encoding_in_parts.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "pipeline/settle/read_again.h"
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
    throw UsageError("{}: {} needs an output that can be read again; write to a file, or protect it later",
                     shown_output(run.output), setting::parity);
  if (!run.resume) check_output(run.output, run.overwrite);
}

/// Volumes that are written front to back by this process: a file, or a pipe.
class EncodingToStream {
 public:
  /// Both arguments must outlive all calls but commit().
  EncodingToStream(const EncodeRun& run, const Resources& resources) : run_(run), resources_(resources) {}

  /// Encodes the bricks of the volume, or of the first one of several. A copy takes the place of a source whose rows
  /// must be read in another order.
  void encode(const EncodeJob& job, std::unique_ptr<VolumeSource>& source, EncodeResult& result) {
    const OutputFileOptions like = {.like = attributes_of(source->files().back())};
    file_ = std::make_unique<OutputFile>(run_.output, run_.overwrite, like);
    writer_.emplace(*file_, job.header);
    const bool spools = job.plan.spooled && !source->traits().any_rows;
    if (spools) source = spooled(std::move(source), resources_.spool.value());
    const VolumeInfo& info = source->info();
    watch_.emplace(run_.progress, sample_bytes(info.dims, info.type).value());
    const auto first = info.volumes > 1 ? one_of_volumes(*source, 0) : nullptr;
    overviews_.emplace(encode_bricks(job, first ? *first : *source, *writer_, result));
    result.times_read +=
        times_read(job.parameters(), job.plan, {BrickRows::all(job.parameters().bricks())}) + spools;
  }

  void look_at(SourceFiles& files, bool exact) { look_at_contents(files, exact, resources_.threads); }
  void write_envelope(std::span<const std::byte> bytes) { writer_->write_envelope(bytes); }

  /// Encodes the other volumes of a source of several, each as a member of the file. Call it after write_envelope().
  void encode_others(const EncodeJob& job, VolumeSource& source, EncodeResult& result) {
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
      writer_->write_member(volume_kind, static_cast<std::uint32_t>(number), encoded);
    }
    result.bytes_in = source.bytes_read();
  }

  /// Writes the end of the file.
  void finish(EncodeResult& result) {
    overviews_->write(*writer_, unwatched_);
    writer_->finish();
    result.index = writer_->index();
    result.index.total.add(total_);
    result.file_bytes = end_with_parity(*file_, file_->position(), run_.options.parity, resources_);
    result.temporary = file_->temporary();
  }

  void commit() { file_->commit(); }

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
template <class Output>
struct LockedCommit {
  std::shared_ptr<Output> written;
  std::string path;
  UnchangedFiles source;
  std::function<void()> before_name;

  void commit() const {
    std::optional<OutputLock> lock;
    if (is_regular_output(path)) lock.emplace(file_of_link(path));
    source.require();
    if (before_name) before_name();
    written->commit();
  }
};

/// The volume of a run, and its files, which are watched from before they are read.
struct Original {
  explicit Original(const EncodeRun& run) : volume(opened(run)), files(volume->files()) {}

  std::unique_ptr<VolumeSource> volume;
  UnchangedFiles files;

 private:
  static std::unique_ptr<VolumeSource> opened(const EncodeRun& run) {
    check_early(run);
    std::unique_ptr<VolumeSource> volume = open_volume(run.input, run.source);
    for (const std::string& file : volume->files()) refuse_same_file(file, run.output);
    return volume;
  }
};

std::uint64_t memory_of_parity(const EncodeRun& run, const VolumeInfo& info) {
  return run.options.parity ? least_memory_of_parity(*sample_bytes(info.dims, info.type), *run.options.parity)
                            : 0;
}

/// What the job of a run is settled for. `reading`: how the bricks will be read.
Settling settling_of(const EncodeRun& run, const Resources& resources, const Reading& reading,
                     const VolumeSource& volume) {
  return {.resources = resources,
          .any_rows = reading.any_rows,
          .needs = {.besides = reading.memory + memory_of_files(run, volume),
                    .verified = original_access(run, volume),
                    .afterwards = memory_of_parity(run, volume.info())},
          .searching = run.searching,
          .before_copy = run.before_copy};
}

/// Settles the job of a run, and begins its result.
EncodeJob settled(const EncodeRun& run, const Settling& settling, Original& original, EncodeResult& result) {
  EncodeJob job = settle_any(run.options, original.volume, settling);
  const VolumeSource& volume = *original.volume;
  result.memory = job.memory;
  if (run.options.parity)
    result.memory = std::max(result.memory, std::min(settling.needs.afterwards + usual_parity_memory,
                                                     settling.resources.memory.value_or(UINT64_MAX)));
  result.header = job.header;
  result.reason_of_bound = job.reason_of_bound;
  result.times_read = job.times_read;
  result.warnings = all_warnings(volume.facts());
  result.missing_of_voxel_size = volume.facts().missing_of_voxel_size;
  if (!job.doubt_of_bound.empty()) result.warnings.push_back(volume.name() + ": " + job.doubt_of_bound);
  result.lossy_source = volume.info().metadata.text_of(lossy_source_key);
  return job;
}

/// Writes the envelope of the source, if it is wanted and the source allows it.
template <class Output>
void keep_source_files(const EncodeRun& run, const EncodeJob& job, const VolumeSource& source, Output& output,
                       EncodeResult& result) {
  result.why_not_restorable = "only the samples were wanted";
  if (!keeps_files(run)) return;
  const bool exact = job.parameters().is_exact();
  SourceFiles files = source_files(source.facts());
  result.warnings.insert(result.warnings.end(), files.warnings.begin(), files.warnings.end());
  if (!files.why_not) {
    output.look_at(files, exact);
    if (std::string about = about_spare_bits_of(files); !about.empty())
      result.warnings.push_back(std::move(about));
    write_envelope(files, [&](std::span<const std::byte> bytes) { output.write_envelope(bytes); });
    result.times_read += times_read_for_envelope(files, exact);
  }
  result.why_not_restorable = files.why_not_restorable();
}

/// Samples and other bytes must be those of the same files.
void require_unchanged(const EncodeRun& run, const Original& original, EncodeResult& result) {
  original.files.require();
  warn_of_touched(run, original.files, result);
}

template <class Output>
FinishedEncode finished(const EncodeRun& run, const Original& original, std::shared_ptr<Output> output,
                        EncodeResult result) {
  output->finish(result);
  return {std::move(result), std::make_shared<LockedCommit<Output>>(LockedCommit<Output>{
                                 std::move(output), run.output, original.files, run.before_name})};
}

}  // namespace

FinishedEncode encode_to_stream(const EncodeRun& run, const Resources& resources) {
  Original original(run);
  EncodeResult result;
  const SourceTraits& traits = original.volume->traits();
  const Settling settling = settling_of(run, resources, {traits.any_rows, traits.memory}, *original.volume);
  const EncodeJob job = settled(run, settling, original, result);
  const auto stream = std::make_shared<EncodingToStream>(run, resources);
  stream->encode(job, original.volume, result);
  keep_source_files(run, job, *original.volume, *stream, result);
  stream->encode_others(job, *original.volume, result);
  require_unchanged(run, original, result);
  return finished(run, original, stream, std::move(result));
}

FinishedEncode encode_in_parts(Ranks& ranks, const EncodeRun& run) {
  const Resources resources = of_this_rank(ranks, run.resources);
  Original original(run);
  EncodeResult result;
  Settling settling =
      settling_of(run, resources, {true, memory_besides_parts(*original.volume)}, *original.volume);
  // A request that is refused leaves an earlier run alone.
  plan_of(in_samples(run.options, original.volume->facts()), settling);
  const auto parts = std::make_shared<EncodingInParts>(ranks, run, *original.volume);
  settling.earlier = parts->earlier_findings();
  const EncodeJob job = settled(run, settling, original, result);
  const Made made = parts->take(job);
  if (made == Made::no) {
    parts->encode(job, *original.volume, result);
    keep_source_files(run, job, *original.volume, *parts, result);
    require_unchanged(run, original, result);
  } else if (made == Made::in_doubt) {
    require_earlier_result(run, job, *original.volume, resources);
    result.was_complete = true;
  }
  return finished(run, original, parts, std::move(result));
}

}  // namespace tagrid
