#include "pipeline/run/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "io/files/spool_file.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/metadata.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/decode/graph.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/reading/read_region.h"
#include "pipeline/restore/restore.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {
namespace {

// True if parts can be read and written independently: from a file or a directory to a file.
bool parts_are_possible(const std::string& input, const std::string& output) {
  return is_file_or_folder(input) && is_regular_output(output);
}

DecodePlan plan_of(DecodeOutput& output, const CodingParameters& parameters, const WrittenNumbers& numbers,
                   const Resources& resources) {
  return output.plan([&](std::uint64_t memory) {
    return plan_decoding(parameters, resources, output.any_order() ? DecodeUse::write : DecodeUse::stream,
                         memory, numbers.value_bytes());
  });
}

// Of a run whose samples were written.
DecodeResult result_of(TagHeader header, TagIndex index, std::uint64_t bytes_in, const DecodePlan& plan,
                       const VolumeSink& sink, const WrittenNumbers& numbers) {
  return {std::move(header), std::move(index), bytes_in,        sink.bytes_written(),
          plan.memory,       sink.facts(),     sink.warnings(), numbers};
}

/// The index is at the end of a file. It is read only where something depends on it. `source`: nullptr for a
/// pipe.
WrittenNumbers numbers_of_stream(const DecodeRun& run, const TagHeader& header,
                                 std::shared_ptr<const ByteSource> source) {
  if (!source || !depends_on_range(run.format, run.numbers, header))
    return written_numbers(run.format, run.numbers, header, nullptr);
  const TagBricks file(std::move(source));
  return written_numbers(run.format, run.numbers, header, &file.index());
}

/// Throws UsageError if a file of several volumes is decoded to something that has only one.
void require_one_volume(const DecodeRun& run, int volumes) {
  const bool is_part = !run.region.is_all() || run.overview != 0 || run.fill;
  if (run.volume || volumes == 1 || (run.format.keeps.volumes && !is_part)) return;
  const Setting volume = {"volume", "its number,"};
  if (is_part)
    throw UsageError("{}: contains {} volumes; {}, {}, {} and {} work on one; select it with {} 0 to {}",
                     run.input, volumes, Setting{"region", "a region"}, Setting{"step", "a step"},
                     Setting{"overview", "an overview"}, Setting{"salvage", "salvaging"}, volume,
                     volumes - 1);
  throw UsageError(
      "{}: contains {} volumes, but the format {} holds one; select it with {} 0 to {}, or write all to "
      "NIfTI",
      run.input, volumes, run.format.name, volume, volumes - 1);
}

/// Decodes the overviews of a volume to the levels of its output.
void decode_levels(const DecodeRun& run, const DecodeOutput& output, VolumeSink& sink,
                   const WrittenNumbers& numbers, const Resources& resources) {
  for (std::size_t i = 0; i < output.levels().size(); ++i) {
    DecodeRun of_level = run;
    of_level.overview = output.levels()[i].factor;
    TagReader reader(std::make_unique<SourceStream>(source_of(of_level)));
    const DecodePlan plan = plan_decoding(reader.parameters(), resources, DecodeUse::stream,
                                          run.format.writes.memory(sink.info()), numbers.value_bytes());
    RowOutput rows(sink.level(i), plan.spooled ? resources.spool : std::nullopt, run.output);
    Watch unwatched;
    decode({reader.parameters(), plan.budget, BrickRows::all(reader.parameters().bricks()), numbers}, reader,
           rows, unwatched);
  }
}

FinishedDecode decode_at_once(const DecodeRun& run, const Resources& resources) {
  // Opened first: the reader moves the standard input, where the source begins.
  const std::shared_ptr<const ByteSource> source = is_regular_input(run.input) ? source_of(run) : nullptr;
  TagReader reader =
      run.overview == 0 ? TagReader(run.input) : TagReader(std::make_unique<SourceStream>(source_of(run)));
  const CodingParameters& parameters = reader.parameters();
  require_one_volume(run, reader.header().volumes);
  if (reader.header().volumes > 1)
    throw UsageError("{}: holds {} volumes, which can only be read from a file; save it to one first",
                     reader.name(), reader.header().volumes);
  const WrittenNumbers numbers = numbers_of_stream(run, reader.header(), source);
  const VolumeInfo info = volume_info_of(reader.header());
  DecodeOutput output(run, info, numbers, parameters);
  const DecodePlan plan = plan_of(output, parameters, numbers, resources);
  const std::shared_ptr<VolumeSink> sink = output.begin();
  RowOutput rows(*sink, plan.spooled ? resources.spool : std::nullopt, run.output);
  ProgressWatch watch(run.progress, sample_bytes(parameters.dims, numbers.type(parameters.type)).value());
  decode({parameters, plan.budget, BrickRows::all(parameters.bricks()), numbers}, reader, rows, watch);
  decode_levels(run, output, *sink, numbers, resources);
  return {result_of(reader.header(), reader.index(), reader.sizes().file, plan, *sink, numbers), sink};
}

/// Volumes of a file of several, one after the other, each by its index: one that is damaged costs no other.
FinishedDecode decode_volumes(const DecodeRun& run, const Resources& resources) {
  const auto file = std::make_shared<const TagBricks>(open_source(run.input));
  const std::int64_t number = run.volume.value_or(0);
  const auto first = volume_in(file, number);
  const CodingParameters& parameters = first->parameters();
  const std::int64_t count = run.volume ? 1 : file->header().volumes;
  TagIndex index = first->index();
  if (!run.volume) index.total = statistics_of_all(*file);
  const WrittenNumbers numbers = written_numbers(run.format, run.numbers, first->header(), &index);
  const VolumeInfo info = run.volume ? volume_info_of(first->header()) : info_of_all(first->header());
  DecodeOutput output(run, info, numbers, parameters);
  const DecodePlan plan = plan_of(output, parameters, numbers, resources);
  const std::shared_ptr<VolumeSink> sink = output.begin();
  ProgressWatch watch(run.progress, sample_bytes(info.dims, numbers.type(parameters.type)).value());
  for (std::int64_t i = 0; i < count; ++i) {
    const auto volume = volume_in(file, number + i);
    RowOutput rows(*sink, plan.spooled ? resources.spool : std::nullopt, run.output,
                   i * Box::of_size(parameters.dims).count());
    BricksInOrder bricks(*volume);
    decode({parameters, plan.budget, BrickRows::all(parameters.bricks()), numbers}, bricks, rows, watch);
  }
  decode_levels(run, output, *sink, numbers, resources);
  DecodeResult result =
      result_of(first->header(), std::move(index), file->sizes().file, plan, *sink, numbers);
  result.metadata = numbers.metadata(info.metadata);
  result.is_one_of_several = count < file->header().volumes;
  result.header.volumes = static_cast<int>(count);
  return {std::move(result), sink};
}

/// The blocks that meet a region of samples of the volume in `input`.
WantedRegion in_blocks(WantedRegion wanted, std::int64_t factor, const std::string& input) {
  const TagBricks file(open_source(input));
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const std::int64_t samples = file.parameters().dims[axis];
    const std::int64_t low = wanted.low[a].value_or(0), high = wanted.high[a].value_or(samples);
    if (low < 0 || low >= high || high > samples) refuse_region(low, high, axis, samples);
    if (wanted.low[a]) wanted.low[a] = low / factor;
    if (wanted.high[a]) wanted.high[a] = (high - 1) / factor + 1;
  }
  return wanted;
}

FinishedDecode decode_to_parts(Ranks& ranks, const DecodeRun& run, const Resources& resources) {
  TagSummary file = summary_of(run.input);
  const CodingParameters& parameters = file.header.parameters;
  const VolumeInfo info = volume_info_of(file.header);
  const WrittenNumbers numbers = written_numbers(run.format, run.numbers, file.header, &file.index);
  DecodeOutput output(run, info, numbers, parameters, true);
  const DecodePlan plan = plan_of(output, parameters, numbers, resources);
  const std::shared_ptr<VolumeSink> sink = output.begin();
  const VolumeSink::Place place = sink->place();
  const DecodeOrder order{run.input, place.file, place.name, place.start, numbers, run.resources};
  send_order(ranks, order);
  decode_parts(ranks, order, run.progress);
  sink->samples_were_placed();
  return {result_of(std::move(file.header), std::move(file.index), file.sizes.file, plan, *sink, numbers),
          sink};
}

}  // namespace

FinishedEncode encode_volume(Ranks& ranks, const EncodeRun& run) {
  run.options.validate();
  refuse_same_file(run.input, run.output);
  const bool in_parts = run.resume || (ranks.count() > 1 && parts_are_possible(run.input, run.output));
  return in_parts ? encode_in_parts(ranks, run) : encode_to_stream(run, of_this_rank(ranks, run.resources));
}

FinishedDecode decode_volume(Ranks& ranks, const DecodeRun& run) {
  refuse_same_file(run.input, run.output);
  refuse_same_file(run.input, samples_path(run.output, run.format));
  const Resources resources = of_this_rank(ranks, run.resources);
  const int volumes = is_regular_input(run.input) ? count_of_volumes(run.input) : 1;
  require_one_volume(run, volumes);
  if (run.overview != 0) {
    DecodeRun of_overview = run;
    of_overview.region = in_blocks(run.region, run.overview, run.input);
    return of_overview.region.is_all() ? decode_at_once(of_overview, resources)
                                       : decode_region(of_overview, resources);
  }
  if (!run.region.is_all() || run.fill) return decode_region(run, resources);
  if (run.volume || volumes > 1) return decode_volumes(run, resources);
  const bool in_parts =
      ranks.count() > 1 && run.format.writes.any_order && parts_are_possible(run.input, run.output);
  return in_parts ? decode_to_parts(ranks, run, resources) : decode_at_once(run, resources);
}

VerifyResult verify_file(Ranks& ranks, const VerifyRun& run) {
  TagReader reader(run.input);
  const bool is_file = run.input != "-" && is_regular_input(run.input);
  VerifySetup setup = verify_setup(reader.name(), reader.header(), run.original, run.source,
                                   of_this_rank(ranks, run.resources),
                                   is_file && run.resources.memory ? memory_of_envelope(run.input) : 0);
  const Metadata metadata_of_original = setup.metadata_of_original;
  const bool has_scale = !setup.is_original_headerless, again = setup.again;
  const auto verified = [&] {
    // Only this rank knows what the user declared.
    if (ranks.count() == 1 || !setup.any_order || !is_file || is_declared_source(run.input) ||
        reader.header().volumes > 1)
      return verify_all(reader, std::move(setup), run.progress);
    const VerifyOrder order{run.input, run.original, run.source, run.resources};
    send_order(ranks, order);
    return verify_parts(ranks, order, std::move(setup), run.progress);
  };
  VerifyResult result = verified();
  if (run.original)
    result.geometry = compare_geometry(result.header.metadata, metadata_of_original, has_scale);
  // Of a pipe, only the checksums of the envelope and of members are checked.
  const bool has_members = !result.index.members.empty();
  result.are_members_decoded = is_file || !has_members;
  result.are_members_compared = again || !run.original || !has_members;
  if (is_file) {
    const TagBricks file(open_source(run.input));
    source_files_of(file);
    std::unique_ptr<VolumeSource> original;
    if (again && !file.index().members.empty())
      original = open_volume(run.original.value(), source_of_as_many(run.source, file.header()));
    Resources resources = of_this_rank(ranks, run.resources);
    resources.spool = spool_folder(resources.spool, "-");
    verify_members(
        file, original.get(), resources, &result,
        [](const std::string& name, const CodingParameters& parameters, std::unique_ptr<VolumeSource> volume,
           const Resources& given) { return setup_against(name, parameters, std::move(volume), given); });
  }
  return result;
}

VerifyResult require_result(const EncodeRun& run, const EncodeJob& job, const VolumeSource& original,
                            const Resources& resources) {
  const TagBricks file(std::make_shared<FileSource>(run.output));
  if (serialize_header(file.header()) != serialize_header(job.header))
    throw BrokenInput("made from another volume, or with other options");
  std::vector<int> overviews;
  for (const Member& member : file.index().members)
    if (member.is_overview()) overviews.push_back(static_cast<int>(member.factor));
  const ParityShare share = file.parity() ? file.parity()->share : 0;
  const bool keeps_files = file.sizes().envelope > 0;
  if (overviews != job.overviews || share != run.options.parity.value_or(share) ||
      keeps_files != (run.keep_files && !run.options.strip && !source_files(original.facts()).why_not))
    throw BrokenInput("made with other options");
  Ranks alone;
  VerifyResult found = verify_file(
      alone, {.input = run.output, .original = run.input, .source = run.source, .resources = resources});
  if (keeps_files) require_same(compare_source_files(file, original, resources.threads), original.name());
  return found;
}

namespace {

/// Throws BrokenInput if other files make it another volume than the one of these files, which did not change.
void require_same_volume(const std::string& input, const SourceDescription& source,
                         const UnchangedFiles& files) {
  std::vector<std::string> now;
  try {
    now = open_volume(input, source)->files();
  } catch (const Error& error) {
    throw BrokenInput(
        fmt::format("{}; this changed while {} was being read; encode it again", error.what(), input));
  }
  std::vector<std::string> before = files.paths();
  std::ranges::sort(before);
  for (const std::string& file : now)
    if (!std::ranges::binary_search(before, file))
      throw BrokenInput(
          fmt::format("{}: became a file of {} while that was being read; encode it again", file, input));
}

}  // namespace

void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const UnchangedFiles& files, const Resources& resources) {
  try {
    Ranks alone;
    const VerifyResult found =
        verify_file(alone, {.input = encoded, .original = input, .source = source, .resources = resources});
    if (!found.geometry.differences.empty())
      throw BrokenInput(encoded + ": " + found.geometry.differences.front());
    const TagBricks file(std::make_shared<FileSource>(encoded));
    if (file.sizes().envelope > 0) {
      const auto volume = open_volume(input, source);
      require_same(compare_source_files(file, *volume, resources.threads), volume->name());
    }
  } catch (const BrokenInput& broken) {
    files.require();
    if (const std::string touched = files.touched(); !touched.empty())
      throw BrokenInput(touched + ": was changed while it was being read");
    require_same_volume(input, source, files);
    throw std::runtime_error(std::string(broken.what()) + "; the input was kept");
  }
  files.require();
}

}  // namespace tagrid
