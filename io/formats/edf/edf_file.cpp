#include "io/formats/edf/edf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/rescale.h"
#include "io/samples/slices_in_files.h"
#include "io/text/fields.h"
#include "io/text/foreign_number.h"
#include "io/text/numbered_names.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
#include "io/volume/series_of_files.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

/// A longer header is refused. Those of the ESRF have a few KiB.
constexpr std::size_t max_header_bytes = std::size_t{1} << 20;

/// Type names of the format, in lower case, and those of older programs.
constexpr std::array types = {
    std::pair{"unsignedbyte"sv, SampleType::uint8},     std::pair{"signedbyte"sv, SampleType::int8},
    std::pair{"unsignedshort"sv, SampleType::uint16},   std::pair{"signedshort"sv, SampleType::int16},
    std::pair{"unsignedinteger"sv, SampleType::uint32}, std::pair{"unsignedlong"sv, SampleType::uint32},
    std::pair{"signedinteger"sv, SampleType::int32},    std::pair{"signedlong"sv, SampleType::int32},
    std::pair{"floatvalue"sv, SampleType::float32},     std::pair{"float"sv, SampleType::float32},
    std::pair{"real"sv, SampleType::float32},           std::pair{"floatieee32"sv, SampleType::float32},
    std::pair{"doublevalue"sv, SampleType::float64},    std::pair{"double"sv, SampleType::float64},
    std::pair{"floatieee64"sv, SampleType::float64}};

std::string_view value_of(const TextFields& fields, std::string_view name) {
  return field_of(fields, name).value_or("");
}

/// The bytes after the first brace up to the one that ends the header, with the line end after it; 0 if `text`
/// does not have them.
std::size_t end_of_header(std::string_view text) {
  for (std::size_t at = text.find('}'); at != text.npos; at = text.find('}', at + 1)) {
    const std::string_view after = text.substr(at + 1, 2);
    if (after.starts_with('\n')) return at + 2;
    if (after == "\r\n") return at + 3;
  }
  return 0;
}

/// A header and the place of what follows it.
struct Block {
  TextFields fields;
  std::uint64_t begin = 0, data = 0;  ///< bytes of the file
};

/// Reads the blocks of a file, whose frames must be alike.
class Blocks {
 public:
  explicit Blocks(const FileBytes& file) : file_(file) {}

  /// The header at byte `begin`; nothing if there is none.
  std::optional<Block> header_at(std::uint64_t begin) const {
    std::string text;
    for (std::size_t size = 4096; size <= max_header_bytes; size *= 4) {
      const std::size_t before = text.size();
      text.resize(size);
      text.resize(before + file_.read_at(begin + before, reinterpret_cast<std::byte*>(text.data()) + before,
                                         size - before));
      // Some programs begin a header with a line end.
      const std::size_t brace = text.find_first_not_of("\r\n");
      if (brace == text.npos || text[brace] != '{') return std::nullopt;
      if (const std::size_t end = end_of_header(text); end != 0)
        return Block{fields_between_semicolons(std::string_view(text).substr(
                         brace + 1, text.find_last_of('}', end - 1) - brace - 1)),
                     begin, begin + end};
      if (text.size() < size) break;
    }
    throw BrokenInput("{}: the header at byte {} has no end", file_.name(), begin);
  }

  [[noreturn]] void refuse(const Block& block, std::string_view name, std::string_view why) const {
    throw BrokenInput("{}: in its header at byte {}: {} {}: {}", file_.name(), block.begin, name,
                      quoted(value_of(block.fields, lower_case(name))), why);
  }

  std::int64_t count(const Block& block, std::string_view name, std::int64_t otherwise) const {
    const std::string_view value = value_of(block.fields, lower_case(name));
    if (value.empty() && otherwise > 0) return otherwise;
    const auto number = whole_number_of(value);
    if (!number || *number < 1) refuse(block, name, "must be a positive number");
    return *number;
  }

  Index3 dims(const Block& block) const {
    if (!value_of(block.fields, "dim_4").empty()) refuse(block, "Dim_4", "four axes are not supported");
    return {count(block, "Dim_1", 0), count(block, "Dim_2", 1), count(block, "Dim_3", 1)};
  }

  SampleType type(const Block& block) const {
    const std::string name = lower_case(value_of(block.fields, "datatype"));
    const auto found = std::ranges::find(types, name, &std::pair<std::string_view, SampleType>::first);
    if (found == types.end()) refuse(block, "DataType", "is not supported");
    return found->second;
  }

  bool is_big_endian(const Block& block, SampleType type, SourceFacts& facts) const {
    const std::string order = lower_case(value_of(block.fields, "byteorder"));
    if (order == "highbytefirst") return true;
    if (!order.empty() && order != "lowbytefirst")
      refuse(block, "ByteOrder", "must be LowByteFirst or HighByteFirst");
    if (order.empty() && size_of(type) > 1 && facts.places.empty())
      facts.not_understood.push_back(
          fmt::format("{}: does not state its byte order; samples are read as LowByteFirst", file_.name()));
    return false;
  }

  void refuse_what_changes_samples(const Block& block) const {
    const std::string compression = lower_case(value_of(block.fields, "compression"));
    if (!compression.empty() && compression != "none" && compression != "uncompressed" &&
        compression != "unspecified" && compression != "nocompression")
      refuse(block, "Compression", "is not supported");
    if (!value_of(block.fields, "edf_binaryfilename").empty())
      refuse(block, "EDF_BinaryFileName", "samples in another file are not supported");
    if (lower_case(value_of(block.fields, "edf_datablockid")).ends_with(".error"))
      refuse(block, "EDF_DataBlockID", "errors of samples in the same file are not supported");
  }

  /// The bytes after the header, of which the samples need `needed`.
  std::uint64_t data_bytes(const Block& block, std::uint64_t needed) const {
    for (const std::string_view name : {"EDF_BinarySize"sv, "Size"sv})
      if (const std::string_view value = value_of(block.fields, lower_case(name)); !value.empty()) {
        const auto size = entire<std::uint64_t>(value);
        if (!size || *size < needed || *size > std::uint64_t{1} << 62)
          refuse(block, name, fmt::format("the samples have {} bytes", needed));
        return *size;
      }
    return needed;
  }

  /// A block before the frames that has no samples but says something of all.
  static bool is_general(const Block& block) {
    return value_of(block.fields, "dim_1").empty() && (block.fields.contains("edf_dataformatversion") ||
                                                       value_of(block.fields, "edf_binarysize") == "0");
  }

 private:
  const FileBytes& file_;
};

/// Samples that follow those before at the same distance are of one run.
void add_run(const SliceRun& run, std::vector<SliceRun>& runs) {
  if (!runs.empty() && run.slices == 1 && runs.back().big_endian == run.big_endian) {
    SliceRun& last = runs.back();
    const std::uint64_t begin_of_last = last.offset + static_cast<std::uint64_t>(last.slices - 1) * last.step;
    const std::uint64_t step = run.offset - begin_of_last;
    if (last.slices == 1 || step == last.step) {
      last.step = step;
      ++last.slices;
      return;
    }
  }
  runs.push_back(run);
}

/// What the first header says of all frames.
void describe(const TextFields& fields, const std::string& file, SourceFacts& facts) {
  Geometry geometry;
  std::vector<ForeignNumber> distances;
  std::vector<std::string> names;
  for (const std::string name : {"PSize_1", "PSize_2", "PSize_3"}) {
    distances.push_back(foreign_number(field_of(fields, lower_case(name))));
    names.push_back(fmt::format("{}: {}", file, name));
  }
  set_spacing(distances, names, NegativeSpacing::is_unknown, geometry, facts.warnings);
  if (geometry.has_spacing) geometry.units.fill("m");
  if (const auto value = field_of(fields, "datavalueoffset")) {
    const ForeignNumber offset = foreign_number(value);
    if (offset.is_unreadable())
      facts.scale_doubt =
          fmt::format("{}: {}", file, remark_on(offset, "DataValueOffset", "values are unknown"));
    facts.rescale.intercept = offset.value_or(0);
  }
  for (const std::string_view name : {"rasterorientation"sv, "datarasterconfiguration"sv})
    if (const std::string_view value = value_of(fields, name); !value.empty() && value != "1")
      facts.not_understood.push_back(
          fmt::format("{}: {} is {}; samples are read in the order of the file", file, name, quoted(value)));
  KeyValues pairs;
  add_rescale(facts.rescale, pairs);
  for (const auto& [name, value] : fields)
    if (!name.empty() && !value.empty()) pairs.emplace_back("edf_" + name, value);
  facts.info.metadata = Metadata(geometry, pairs);
  facts.missing_of_voxel_size = missing_of_voxel_size(geometry, true);
}

}  // namespace

bool begins_edf(std::string_view bytes) {
  if (!bytes.starts_with('{')) return false;
  return std::ranges::any_of(
      std::array{"HeaderID"sv, "ByteOrder"sv, "DataType"sv, "EDF_"sv, "Dim_1"sv}, [&](std::string_view word) {
        const std::size_t at = bytes.find(word);
        return at != bytes.npos &&
               trimmed(bytes.substr(at, bytes.find(';', at) - at)).find('=') != bytes.npos &&
               bytes[at - 1] != '"';
      });
}

namespace {

/// The frames of a file, which are alike, with the places of their samples.
SourceFacts frames_of(const FileBytes& file, const std::string& path, std::uint64_t size) {
  const std::string name = file.name();
  const Blocks blocks(file);
  SourceFacts facts;
  facts.files = {path};
  facts.holds_other_bytes = true;
  std::int64_t frames = 0;
  std::uint64_t at = 0;
  while (at < size) {
    const auto block = blocks.header_at(at);
    if (!block && frames == 0) throw BrokenInput(name + ": has no header of EDF");
    if (!block) break;
    if (frames == 0 && Blocks::is_general(*block)) {
      at = block->data;
      continue;
    }
    blocks.refuse_what_changes_samples(*block);
    const Index3 dims = blocks.dims(*block);
    const SampleType type = blocks.type(*block);
    const auto needed = sample_bytes(dims, type);
    if (!needed || !is_volume_size(dims))
      throw BrokenInput("{}: a volume cannot have {} samples", name, described(dims, type));
    if (frames == 0) {
      facts.info = {dims, type};
      describe(block->fields, name, facts);
    } else if (dims.x != facts.info.dims.x || dims.y != facts.info.dims.y || dims.z > 1 ||
               type != facts.info.type || facts.info.dims.z > frames) {
      throw BrokenInput(
          "{}: frame {} has {} samples, and others do not; only slices of one size and "
          "type are a volume",
          name, frames + 1, described(dims, type));
    }
    if (size - block->data < *needed)
      throw BrokenInput(
          "{}: {} bytes of samples are expected from byte {} on (frame {}: {}), but {} are present", name,
          *needed, block->data, frames + 1, described(dims, type), size - block->data);
    add_run({.offset = block->data,
             .slices = dims.z,
             .step = *sample_bytes({dims.x, dims.y, 1}, type),
             .big_endian = blocks.is_big_endian(*block, type, facts)},
            facts.places);
    facts.info.dims.z = frames == 0 ? dims.z : frames + 1;
    ++frames;
    at = std::min(size, block->data + blocks.data_bytes(*block, *needed));
  }
  if (frames == 0) throw BrokenInput(name + ": has no frames");
  if (!is_volume_size(facts.info.dims))
    throw BrokenInput("{}: a volume cannot have {} samples", name,
                      described(facts.info.dims, facts.info.type));
  if (at < size) {
    const std::uint64_t slice = *sample_bytes({facts.info.dims.x, facts.info.dims.y, 1}, facts.info.type);
    (size - at < slice ? facts.warnings : facts.not_understood)
        .push_back(
            fmt::format("{}: {} bytes follow the samples; they are not part of the volume", name, size - at));
  }
  return facts;
}

std::unique_ptr<VolumeSource> placed(SourceFacts facts) {
  auto runs = std::exchange(facts.places, {});
  return placed_samples(std::move(facts), std::move(runs));
}

/// Unknown distances are not numbers, and so not equal to themselves.
bool has_same_spacing(const Geometry& a, const Geometry& b) {
  return a.has_spacing == b.has_spacing && std::ranges::equal(a.spacing, b.spacing, [](double x, double y) {
           return x == y || (std::isnan(x) && std::isnan(y));
         });
}

/// Adds the slice in a file to those before it.
void add_slice(const SourceFacts& slice, SourceFacts& all) {
  const std::string &path = slice.files.front(), &first = all.files.front();
  if (slice.info.dims != all.info.dims || slice.info.type != all.info.type)
    throw BrokenInput("{}: has {} samples, but {} has {}", path, described(slice.info.dims, slice.info.type),
                      first, described(all.info.dims, all.info.type));
  if (slice.rescale != all.rescale)
    throw BrokenInput("{}: has another DataValueOffset than {}, and one volume cannot have both", path,
                      first);
  if (all.scale_doubt.empty()) all.scale_doubt = slice.scale_doubt;
  if (!has_same_spacing(slice.info.geometry(), all.info.geometry()))
    all.not_understood.push_back(path +
                                 ": states another size of pixels than the first slice, whose size is used");
  for (SliceRun run : slice.places) {
    run.file = all.files.size();
    all.places.push_back(run);
  }
  all.files.push_back(path);
  all.warnings.insert(all.warnings.end(), slice.warnings.begin(), slice.warnings.end());
  all.not_understood.insert(all.not_understood.end(), slice.not_understood.begin(),
                            slice.not_understood.end());
}

/// Sentences about many files say the same: the first ones are kept.
void shorten(std::vector<std::string>& sentences, const std::string& folder) {
  constexpr std::size_t most = 3;
  if (sentences.size() <= most) return;
  const std::size_t more = sentences.size() - most;
  sentences.resize(most);
  sentences.push_back(fmt::format("{}: likewise in {} more of its files", folder, more));
}

}  // namespace

std::unique_ptr<VolumeSource> open_edf(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription&) {
  if (path == "-" || !file->size())
    throw UsageError(file->name() +
                     ": is an EDF file, which can only be read from a file; save it to one first");
  return placed(frames_of(*file, path, *file->size()));
}

std::unique_ptr<VolumeSource> open_edf_folder(const std::string& folder, const SourceDescription& source) {
  std::vector<std::string> paths = visible_files(folder);
  std::erase_if(paths, [](const std::string& path) { return !lower_case(path).ends_with(".edf"); });
  const NumberedFiles slices = series_of_files(folder, std::move(paths), source);
  SourceFacts all;
  for (const std::string& path : slices.paths) {
    const FileBytes file(path);
    SourceFacts slice = frames_of(file, path, file.size().value_or(0));
    if (slice.info.dims.z != 1)
      throw BrokenInput("{}: has {} slices, so it is a volume of its own; give this file", path,
                        slice.info.dims.z);
    if (all.files.empty())
      all = std::move(slice);
    else
      add_slice(slice, all);
  }
  all.info.dims.z = static_cast<std::int64_t>(slices.paths.size());
  if (!is_volume_size(all.info.dims))
    throw BrokenInput("{}: a volume cannot have {} samples", folder, described(all.info.dims, all.info.type));
  shorten(all.warnings, folder);
  shorten(all.not_understood, folder);
  if (slices.gap) all.warnings.push_back(fmt::format("{}: {}", folder, gap_in_words(slices)));
  return placed(std::move(all));
}

}  // namespace tagrid
