#include "io/tag/header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/zstd_bytes.h"
#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "io/tag/index.h"
#include "io/volume/one_of_volumes.h"
#include "stages/bound/bounds.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

// As in PNG: a byte above 127, both line ends and a Ctrl-Z reveal transfers that damage binary files.
constexpr std::array<std::uint8_t, 8> magic = {0x89, 'T', 'A', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::uint32_t version = 5;
constexpr std::size_t checksum_size = 8;
constexpr std::uint32_t max_fields_size = 1 << 24;
// Next to the bits of a step, which is positive.
constexpr std::uint32_t filter_follows = std::uint32_t{1} << 31;

// What a file is that is not a .tag file, and what to do: most often it is the volume itself, given by mistake.
// Only the first bytes are there, which are too few for the table of formats. Nothing if it is unknown.
std::string what_it_is(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  using namespace std::string_view_literals;
  struct Known {
    std::string_view beginning, what;
  };
  constexpr Known known[] = {{"NRRD000"sv, "an NRRD volume"},
                             {"\x20\x42\x44\x56\0\0\0\0"sv, "an OpenVDB file"},
                             {"ObjectType"sv, "a MetaImage file"},
                             {"NDims"sv, "a MetaImage file"},
                             {"\x5c\x01\0\0"sv, "a NIfTI file"},
                             {"\0\0\x01\x5c"sv, "a NIfTI file"},
                             {"\x1c\x02\0\0"sv, "a NIfTI file"},
                             {"\0\0\x02\x1c"sv, "a NIfTI file"},
                             {"II*\0"sv, "a TIFF file"},
                             {"MM\0*"sv, "a TIFF file"},
                             {"II+\0"sv, "a TIFF file"},
                             {"MM\0+"sv, "a TIFF file"},
                             {"\x89HDF\r\n\x1a\n"sv, "an HDF5 file"}};
  if (text.empty()) return ": it is empty";
  for (const auto& [beginning, what] : known)
    if (text.starts_with(beginning)) return ", but " + std::string(what) + "; encode it first";
  return "";
}

std::string words_of_version(std::uint32_t found) {
  return "the file has format version " + std::to_string(found) + ", but this tagrid reads version " +
         std::to_string(version);
}

/// The parameters' fields, for a FieldWriter or a FieldReader.
void parameter_fields(auto& fields, auto& p) {
  for (int axis = 0; axis < 3; ++axis) fields.field(p.dims[axis]);
  fields.field(p.type, std::uint8_t{});
  fields.field(p.mode, std::uint8_t{});
  for (auto* number : {&p.cube_size, &p.brick_edge, &p.max_level}) fields.field(*number, std::uint16_t{});
  fields.field(p.accuracy, std::uint32_t{});
  fields.field(p.effort, std::uint16_t{});
  fields.field(p.grid, std::uint8_t{});
  fields.field(p.lead, std::uint8_t{});
  for (auto* number : {&p.field_scale, &p.range_low, &p.range_high, &p.max_error, &p.surface_error,
                       &p.mesh_error, &p.point_error})
    fields.field(*number);
}

}  // namespace

bool begins_as_tag(std::span<const std::byte> bytes) {
  return bytes.size() >= magic.size() &&
         std::ranges::equal(bytes.first(magic.size()), std::as_bytes(std::span(magic)));
}

Status check_parameters(const CodingParameters& p) {
  if (!is_volume_size(p.dims))
    return Status::broken(
        "a dimension of the volume is not from 1 to 2^31, or the volume has more than 2^58 samples");
  if (!is_sample_type(p.type)) return Status::newer("the sample type is unknown");
  if (p.mode != FileMode::voxels && p.mode != FileMode::grid) return Status::newer("the mode is unknown");
  if (p.effort > Effort::best) return Status::newer("the effort is unknown");
  if (p.grid > GridOrigin::implied) return Status::newer("the origin of the grid is unknown");
  if (p.cube_size < min_cube_size || p.cube_size > max_cube_size ||
      !std::has_single_bit(static_cast<unsigned>(p.cube_size)))
    return Status::broken("the edge of a root cube is not a power of two from 4 to 256");
  if (p.brick_edge < 1 || p.brick_edge * p.cube_size > 512)
    return Status::broken("the edge of a brick is not from 1 root cube to 512 samples");
  if (p.lead != 0 && p.lead != 1)
    return Status::broken("the lattice begins neither at the first sample nor one step before it");
  if (p.max_level < 0 || p.max_level > max_level(p.cube_size))
    return Status::broken("the level limit is out of range");
  if (p.accuracy < 3 || p.accuracy > max_accuracy)
    return Status::broken("the accuracy is not from 3 to 1000000");
  if (!(p.field_scale > 0) || !std::isfinite(p.field_scale))
    return Status::broken("the field scale is not positive");
  if (!std::isfinite(p.range_low) || !std::isfinite(p.range_high))
    return Status::broken("the value range is not finite");
  for (const double e : {p.max_error, p.surface_error, p.mesh_error})
    if (!is_bound(e) && e != -1)
      return Status::broken("a bound is neither absent nor a finite number of at least 0");
  if (!is_bound(p.point_error))
    return Status::broken("the error of points is not a finite number of at least 0");
  if (p.mode == FileMode::voxels && p.max_error < 0) return Status::broken("a file with voxels has no bound");
  if (p.surface_error >= 0 && (p.mode == FileMode::grid || p.surface_error >= p.max_error))
    return Status::broken("the bound of active voxels is not below that of the others");
  if (!p.stores_activity() && (p.mode == FileMode::grid || p.surface_error >= 0 || p.mesh_error >= 0))
    return Status::broken("a grid that is not stored has a mode or a bound that needs it");
  if (p.grid == GridOrigin::implied && !p.implies_grid())
    return Status::broken("the grid is implied, but the samples are not exact");
  if (p.transform_step > 0 && (p.mode == FileMode::grid || p.surface_error >= 0 || p.is_exact()))
    return Status::broken("a transform is not for this mode or these bounds");
  if (!(p.transform_step >= 0) ||
      (p.transform_step > 0 && p.transform_step != kept_step(p.transform_step, p.type)))
    return Status::broken("the step of the transform is out of range");
  if (is_filter(p.filter) &&
      (!(p.transform_step > 0) || std::ranges::any_of(p.filter, [](std::int16_t weight) {
        return weight < -most_filter_weight || weight > most_filter_weight;
      })))
    return Status::broken("the filter has no transform before it, or weights out of range");
  if (p.mode == FileMode::grid && p.thresholds.count > 0)
    return Status::broken("a file without voxels has thresholds");
  double before = -std::numeric_limits<double>::infinity();
  for (const double threshold : p.thresholds.numbers()) {
    if (threshold_of(threshold, p.type) != threshold || !(threshold > before))
      return Status::broken("the thresholds are not increasing samples above the lowest one");
    before = threshold;
  }
  if (p.range_low > p.range_high)
    return Status::broken("the low end of the value range is above its high end");
  return {};
}

bool are_same(const CodingParameters& a, const CodingParameters& b) {
  FieldWriter of_a, of_b;
  parameter_fields(of_a, a);
  parameter_fields(of_b, b);
  return of_a.bytes() == of_b.bytes() && a.transform_step == b.transform_step && a.filter == b.filter &&
         a.thresholds == b.thresholds;
}

Status check_volumes(const CodingParameters& p, std::int64_t volumes) {
  if (volumes < 1 || volumes > most_volumes)
    return Status::broken("the number of volumes is not from 1 to " + std::to_string(most_volumes));
  if (volumes == 1) return {};
  if (!is_volume_size({p.dims.x, p.dims.y, p.dims.z * volumes}))
    return Status::broken("all volumes together have more than 2^31 slices or 2^58 samples");
  if (!has_room_for_volumes(PageLayout(p.bricks().count()).pages(), volumes))
    return Status::broken("the index has no room for so many volumes of so many bricks");
  return {};
}

Status check_metadata(const Metadata& metadata) {
  // Compressed text is hardly longer than the text, so little of it has to be compressed to know.
  constexpr std::size_t surely_fits = max_header_size / 2;
  const std::size_t size = text_of(metadata).size();
  if (size <= surely_fits) return {};
  if (size <= max_fields_size && serialize_header({{}, metadata}).size() <= max_header_size) return {};
  return Status::broken("its metadata takes " + std::to_string(size) +
                        " bytes, but a .tag file has room for only " + std::to_string(max_fields_size) +
                        ", compressed or not");
}

std::vector<std::byte> serialize_header(const TagHeader& header) {
  FieldWriter fields;
  parameter_fields(fields, header.parameters);
  const auto text = std::as_bytes(std::span(text_of(header.metadata)));
  const std::vector<std::byte> packed = zstd_compress(text);
  fields.put(static_cast<std::uint32_t>(header.volumes));
  fields.put(static_cast<std::uint32_t>(text.size()));
  fields.put(static_cast<std::uint32_t>(packed.size()));
  fields.put_bytes(packed);
  // At the end and only if there is one, so that other files keep their bytes.
  const CodingParameters& p = header.parameters;
  if (p.transform_step > 0)
    fields.put((is_float_type(p.type) ? std::bit_cast<std::uint32_t>(static_cast<float>(p.transform_step))
                                      : static_cast<std::uint32_t>(p.transform_step / least_transform_step)) |
               (is_filter(p.filter) ? filter_follows : 0));
  if (is_filter(p.filter))
    for (const std::int16_t weight : p.filter) fields.put(static_cast<std::uint16_t>(weight));
  for (const double threshold : p.thresholds.numbers()) fields.put(threshold);

  FieldWriter whole;
  whole.put_bytes(std::as_bytes(std::span(magic)));
  whole.put(version);
  whole.put(static_cast<std::uint32_t>(tag_preamble_size + fields.bytes().size() + checksum_size));
  whole.put_bytes(fields.bytes());
  whole.put(checksum_of({whole.bytes()}));
  return std::move(whole.bytes());
}

Status parse_preamble(std::span<const std::byte> preamble, std::size_t& header_size) {
  FieldReader reader(preamble);
  reader.get_bytes(magic.size());
  if (!begins_as_tag(preamble)) {
    const std::string known = what_it_is(preamble);
    return Status::broken("this is not a .tag file" +
                          (known.empty() ? ", or its beginning is damaged" : known));
  }
  if (preamble.size() < tag_preamble_size)
    return Status::broken("the file ends in its header; it is truncated");
  const auto file_version = reader.get<std::uint32_t>();
  // A newer one is refused when the checksum has shown that it is not damage.
  if (file_version < version) return Status::broken(words_of_version(file_version));
  const auto size = reader.get<std::uint32_t>();
  if (!reader.complete() || size > max_header_size || size < tag_preamble_size + checksum_size)
    return Status::broken("the header gives an impossible size for itself");
  header_size = size;
  return {};
}

Status parse_header(std::span<const std::byte> bytes, TagHeader& header, std::uint64_t& checksum) {
  std::size_t header_size = 0;
  if (bytes.size() < tag_preamble_size + checksum_size) return Status::broken("the header ends too soon");
  if (Status status = parse_preamble(bytes.first(tag_preamble_size), header_size); !status.ok())
    return status;
  if (bytes.size() != header_size) return Status::broken("the header ends too soon");
  checksum = load_little_endian<std::uint64_t>(bytes.data() + bytes.size() - checksum_size);
  const bool agree = checksums_agree(checksum, checksum_of({bytes.first(bytes.size() - checksum_size)}));
  if (const auto file_version = load_little_endian<std::uint32_t>(bytes.data() + magic.size());
      file_version != version)
    return agree ? Status::newer(words_of_version(file_version))
                 : Status::broken(words_of_version(file_version) + ", or the header is damaged");
  if (!agree)
    return Status::broken(
        "the header, without which nothing can be decoded, is damaged: its checksum does not match");

  FieldReader reader(bytes.subspan(tag_preamble_size, bytes.size() - tag_preamble_size - checksum_size));
  parameter_fields(reader, header.parameters);
  const auto volumes = reader.get<std::uint32_t>();
  const auto text_size = reader.get<std::uint32_t>();
  const auto packed_size = reader.get<std::uint32_t>();
  const auto packed = reader.get_bytes(packed_size);
  // A step has 4 bytes, a threshold 8.
  const bool transformed = reader.left() % 8 == 4;
  bool filtered = false;
  CodingParameters& p = header.parameters;
  p.transform_step = 0;
  if (transformed) {
    auto step = reader.get<std::uint32_t>();
    filtered = (step & filter_follows) != 0;
    step &= ~filter_follows;
    p.transform_step =
        is_float_type(p.type) ? double{std::bit_cast<float>(step)} : step * least_transform_step;
  }
  p.filter = {};
  if (filtered)
    for (std::int16_t& weight : p.filter) weight = static_cast<std::int16_t>(reader.get<std::uint16_t>());
  p.thresholds = {};
  while (reader.left() >= 8 && p.thresholds.count < most_thresholds)
    p.thresholds.append(reader.get<double>());
  if (!reader.complete() || text_size > max_fields_size)
    return Status::broken("the header's fields do not fit its size");
  if (transformed && !(p.transform_step > 0))
    return Status::broken("the step of the transform is not positive");
  if (filtered && !is_filter(p.filter)) return Status::broken("the filter of the transform has no weights");
  std::vector<std::byte> text;
  if (Status status = zstd_decompress(packed, text_size, text); !status.ok())
    return Status::broken("the source's fields in the header: " + status.what());
  header.volumes = static_cast<int>(std::min<std::uint32_t>(volumes, most_volumes + 1));
  if (Status status = check_parameters(header.parameters); !status.ok()) return status;
  if (Status status = check_volumes(header.parameters, header.volumes); !status.ok()) return status;
  try {
    header.metadata = parse_metadata({reinterpret_cast<const char*>(text.data()), text.size()});
  } catch (const BrokenInput& broken) {
    return Status::broken(std::string("the source's fields in the header: ") + broken.what());
  }
  return {};
}

VolumeInfo volume_info_of(const TagHeader& header) {
  return {header.parameters.dims, header.parameters.type, header.metadata};
}

VolumeInfo info_of_all(const TagHeader& header) {
  VolumeInfo info = volume_info_of(header);
  // The name of the first one is not that of all.
  if (header.volumes > 1) info.metadata.erase(volume_name_key);
  info.dims = header.all_dims();
  info.volumes = header.volumes;
  return info;
}

std::string name_of_volume(const TagHeader& header) { return header.metadata.text_of(volume_name_key); }

BrokenInput broken_input_of(const std::string& file, const Status& status) {
  return BrokenInput(file + ": " + status.what(), status.is_newer() ? Problem::newer_format : Problem::none);
}

std::size_t header_size_of(const std::string& file, std::span<const std::byte> preamble) {
  std::size_t size = 0;
  if (Status status = parse_preamble(preamble, size); !status.ok())
    throw begins_as_tag(preamble) || !what_it_is(preamble).empty()
        ? broken_input_of(file, status)
        : BrokenInput(file + ": " + status.what(), Problem::unknown_beginning);
  return size;
}

TagHeader header_of(const std::string& file, std::span<const std::byte> bytes, std::uint64_t& checksum) {
  TagHeader header;
  if (Status status = parse_header(bytes, header, checksum); !status.ok())
    throw broken_input_of(file, status);
  return header;
}

}  // namespace tagrid
