#include "io/formats/nifti/sink.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "io/bytes/little_endian.h"
#include "io/formats/nifti/forms.h"
#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/lost_places.h"
#include "io/formats/nrrd/rescale.h"
#include "io/formats/nrrd/spaces.h"
#include "io/samples/file_sink.h"
#include "io/samples/gzip_sink.h"
#include "io/text/text.h"
#include "io/volume/lengths.h"

namespace tagrid {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;  // [axis of the volume][axis of the world]

/// A header of either version, as bytes.
class HeaderBytes {
 public:
  explicit HeaderBytes(bool is_second) : is_second_(is_second), bytes_(is_second ? 544 : 352, '\0') {}

  /// `first` and `second` are the places in the versions; the number becomes the type of each.
  template <class First, class Second>
  void put(std::size_t first, std::size_t second, double number) {
    if (is_second_)
      store(second, static_cast<Second>(number));
    else
      store(first, static_cast<First>(number));
  }
  void put_text(std::size_t first, std::size_t second, std::size_t size, std::string_view text) {
    text = text.substr(0, size);
    std::memcpy(bytes_.data() + (is_second_ ? second : first), text.data(), text.size());
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class T>
  void store(std::size_t at, T value) {
    store_little_endian(reinterpret_cast<std::byte*>(bytes_.data()) + at, value);
  }

  bool is_second_;
  std::string bytes_;
};

std::int32_t datatype_of(SampleType type) {
  switch (type) {
    case SampleType::uint8:
      return 2;
    case SampleType::int16:
      return 4;
    case SampleType::int32:
      return 8;
    case SampleType::float32:
      return 16;
    case SampleType::float64:
      return 64;
    case SampleType::int8:
      return 256;
    case SampleType::uint16:
      return 512;
    case SampleType::uint32:
      return 768;
  }
  return 0;
}

/// Directions and origin in right-anterior-superior.
struct Placement {
  Matrix directions;
  std::array<double, 3> origin;
};

Placement placement_of(const Geometry& geometry) {
  Placement placement{geometry.directions, geometry.origin};
  const auto signs = signs_of_space(geometry.space).value_or(std::array{1, 1, 1});
  for (std::size_t row = 0; row < 3; ++row) {
    if (signs[row] == 1) continue;
    placement.origin[row] = -placement.origin[row];
    for (auto& direction : placement.directions) direction[row] = -direction[row];
  }
  return placement;
}

/// A rotation as b, c, d of a quaternion, and the sign of z; nothing if axes are not at right angles.
struct Rotation {
  std::array<double, 3> bcd;
  double qfac = 1;
};

std::optional<Rotation> rotation_of(const Matrix& directions, const std::array<double, 3>& spacing) {
  Matrix r;  // [row][column], columns are the axes
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t row = 0; row < 3; ++row) r[row][axis] = directions[axis][row] / spacing[axis];
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (std::abs(r[0][a] * r[0][b] + r[1][a] * r[1][b] + r[2][a] * r[2][b]) > 1e-5) return std::nullopt;
  Rotation rotation;
  if (determinant(directions) < 0) {
    rotation.qfac = -1;
    for (auto& row : r) row[2] = -row[2];
  }
  // The largest of a, b, c, d first, so that no small number is divided by.
  const double aa = 1 + r[0][0] + r[1][1] + r[2][2], bb = 1 + r[0][0] - r[1][1] - r[2][2],
               cc = 1 - r[0][0] + r[1][1] - r[2][2], dd = 1 - r[0][0] - r[1][1] + r[2][2];
  double a, b, c, d;
  if (aa >= std::max({bb, cc, dd})) {
    a = std::sqrt(aa) / 2;
    b = (r[2][1] - r[1][2]) / (4 * a), c = (r[0][2] - r[2][0]) / (4 * a), d = (r[1][0] - r[0][1]) / (4 * a);
  } else if (bb >= std::max(cc, dd)) {
    b = std::sqrt(bb) / 2;
    a = (r[2][1] - r[1][2]) / (4 * b), c = (r[0][1] + r[1][0]) / (4 * b), d = (r[0][2] + r[2][0]) / (4 * b);
  } else if (cc >= dd) {
    c = std::sqrt(cc) / 2;
    a = (r[0][2] - r[2][0]) / (4 * c), b = (r[0][1] + r[1][0]) / (4 * c), d = (r[1][2] + r[2][1]) / (4 * c);
  } else {
    d = std::sqrt(dd) / 2;
    a = (r[1][0] - r[0][1]) / (4 * d), b = (r[0][2] + r[2][0]) / (4 * d), c = (r[1][2] + r[2][1]) / (4 * d);
  }
  const double sign = a < 0 ? -1 : 1;
  rotation.bcd = {sign * b, sign * c, sign * d};
  return rotation;
}

using Pairs = std::map<std::string, std::string>;

double number_in(const Pairs& pairs, const char* name, double otherwise) {
  const auto found = pairs.find(name);
  return found == pairs.end() ? otherwise : number_of(found->second).value_or(otherwise);
}

/// Codes of the standard: coordinates of the scanner, and others.
constexpr double in_scanner = 1, aligned = 2;

/// The units that NIfTI has, by their codes from 1 on.
constexpr std::array<std::string_view, 3> units_of_nifti = {"m", "mm", "um"};

/// In one unit that NIfTI has, if the units are known.
Geometry geometry_in_file(const Geometry& geometry) {
  const CommonUnit unit = common_unit(geometry);
  if (!unit.is_known) return geometry;
  const bool has_it = std::ranges::find(units_of_nifti, unit.name) != units_of_nifti.end();
  return in_unit(geometry, has_it ? unit.name : "mm");
}

int code_of_unit(const Geometry& geometry) {
  const CommonUnit unit = common_unit(geometry);
  const auto found = std::ranges::find(units_of_nifti, unit.name);
  return unit.is_mixed || found == units_of_nifti.end()
             ? 0
             : static_cast<int>(found - units_of_nifti.begin()) + 1;
}

void put_sform(HeaderBytes& header, const Placement& placement, double code) {
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      header.put<float, double>(280 + 16 * row + 4 * axis, 400 + 32 * row + 8 * axis,
                                placement.directions[axis][row]);
    header.put<float, double>(292 + 16 * row, 424 + 32 * row, placement.origin[row]);
  }
  header.put<std::int16_t, std::int32_t>(254, 348, code);
}

void put_qform(HeaderBytes& header, const std::array<double, 3>& bcd, const std::array<double, 3>& origin,
               double code) {
  header.put<std::int16_t, std::int32_t>(252, 344, code);
  for (std::size_t i = 0; i < 3; ++i) {
    header.put<float, double>(256 + 4 * i, 352 + 8 * i, bcd[i]);
    header.put<float, double>(268 + 4 * i, 376 + 8 * i, origin[i]);
  }
}

/// Fields of a NIfTI source that say nothing about its place.
void put_other_fields(HeaderBytes& header, const Pairs& pairs, const Index3& dims) {
  header.put<float, double>(128, 200, number_in(pairs, "nifti_cal_min", 0));
  header.put<float, double>(124, 192, number_in(pairs, "nifti_cal_max", 0));
  header.put<std::int16_t, std::int32_t>(68, 504, number_in(pairs, "nifti_intent_code", 0));
  header.put<std::uint8_t, std::uint8_t>(39, 524, number_in(pairs, "nifti_dim_info", 0));
  header.put<std::uint8_t, std::int32_t>(122, 496, number_in(pairs, "nifti_slice_code", 0));
  header.put<float, double>(132, 208, number_in(pairs, "nifti_slice_duration", 0));
  header.put<float, double>(136, 216, number_in(pairs, "nifti_toffset", 0));
  // In a part of the source, they would name slices that do not exist.
  const double start = number_in(pairs, "nifti_slice_start", 0), end = number_in(pairs, "nifti_slice_end", 0);
  if (start >= 0 && end < static_cast<double>(dims.z) && start <= end) {
    header.put<std::int16_t, std::int64_t>(74, 224, start);
    header.put<std::int16_t, std::int64_t>(120, 232, end);
  }
  if (const auto text = pairs.find("nifti_intent_p1_p2_p3"); text != pairs.end())
    for (std::size_t i = 0; const std::string_view word : words_of(text->second)) {
      if (i == 3) break;
      header.put<float, double>(56 + 4 * i, 80 + 8 * i, number_of(word).value_or(0));
      ++i;
    }
  const auto put_text = [&](const char* key, std::size_t first, std::size_t second, std::size_t size) {
    if (const auto text = pairs.find(key); text != pairs.end())
      header.put_text(first, second, size, text->second);
  };
  put_text("nifti_descrip", 148, 240, 79);
  put_text("nifti_aux_file", 228, 320, 23);
  put_text("nifti_intent_name", 328, 508, 15);
}

/// The position of the volume. If the source had one form, it comes back. Two different forms come back for
/// the entire volume only.
void put_place(HeaderBytes& header, const Geometry& geometry, const FormsOfSource& forms) {
  std::array<double, 3> spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) spacing[axis] = std::abs(spacing_or_1(geometry, axis));
  double qfac = 1;
  Geometry placed = geometry;
  // Without a form, programs put the volume wherever they like, and a part of it elsewhere. A file that had
  // none gets none.
  const bool had_no_form = forms.is_nifti && !forms.has_sform() && !forms.has_qform();
  const bool is_at_zero = !placed.has_origin && placed.origin == Geometry().origin;
  const double code = placed.has_directions || !placed.space.empty() ? in_scanner : aligned;
  if (!placed.has_directions && !(had_no_form && is_at_zero)) {
    for (std::size_t axis = 0; axis < 3; ++axis) placed.directions[axis][axis] = spacing_or_1(geometry, axis);
    placed.has_directions = true;
  }
  if (placed.has_directions) {
    const Placement placement = placement_of(placed);
    const auto rotation = rotation_of(placement.directions, spacing);
    const auto code_or = [&](double of_source) { return of_source >= 1 ? of_source : code; };
    if (forms.differ() && forms.is_whole(placed)) {
      put_qform(header, forms.quatern, forms.qoffset, forms.qform_code);
      qfac = forms.pixdim[0];
      for (std::size_t axis = 0; axis < 3; ++axis) spacing[axis] = forms.pixdim[axis + 1];
    } else if (rotation && !forms.differ() && (forms.has_qform() || !forms.has_sform())) {
      put_qform(header, rotation->bcd, placement.origin, code_or(forms.qform_code));
      qfac = rotation->qfac;
    }
    if (!rotation || forms.has_sform() || !forms.has_qform())
      put_sform(header, placement, code_or(forms.sform_code));
  }
  header.put<float, double>(76, 104, qfac);
  for (std::size_t axis = 0; axis < 3; ++axis)
    header.put<float, double>(80 + 4 * axis, 112 + 8 * axis, spacing[axis]);
}

/// NIfTI-2 is for sizes that NIfTI-1 cannot have.
bool is_second_version(const Index3& dims) { return std::max({dims.x, dims.y, dims.z}) > 32767; }

std::string header_of(const VolumeInfo& info) {
  const auto listed = key_values_of(info.nrrd_fields);
  const Pairs pairs(listed.begin(), listed.end());
  const Index3& dims = info.dims;
  const bool is_second = is_second_version(dims);
  HeaderBytes header(is_second);
  header.put<std::int32_t, std::int32_t>(0, 0, is_second ? 540 : 348);
  header.put_text(344, 4, is_second ? 8 : 4,
                  is_second ? std::string_view("n+2\0\r\n\032\n", 8) : std::string_view("n+1\0", 4));
  const std::array<double, 8> sizes = {
      3, static_cast<double>(dims.x), static_cast<double>(dims.y), static_cast<double>(dims.z), 1, 1, 1, 1};
  for (std::size_t i = 0; i < 8; ++i)
    header.put<std::int16_t, std::int64_t>(40 + 2 * i, 16 + 8 * i, sizes[i]);
  header.put<std::int16_t, std::int16_t>(70, 12, datatype_of(info.type));
  header.put<std::int16_t, std::int16_t>(72, 14, 8 * static_cast<double>(size_of(info.type)));
  header.put<float, std::int64_t>(108, 168, is_second ? 544 : 352);
  const Rescale rescale = tagrid::rescale_of(info.nrrd_fields);
  header.put<float, double>(112, 176, rescale.slope);
  header.put<float, double>(116, 184, rescale.intercept);
  put_other_fields(header, pairs, dims);
  const Geometry geometry = geometry_in_file(info.geometry);
  header.put<std::uint8_t, std::int32_t>(123, 500, code_of_unit(geometry));
  put_place(header, geometry, forms_of_source(listed));
  return header.bytes();
}

/// What a header cannot say.
std::vector<std::string> lost_meaning(const VolumeInfo& info) {
  std::vector<std::string> lost = lost_places(
      info.geometry,
      {.name = "NIfTI", .space = "right-anterior-superior", .unknown_unit = "the spacing has none"});
  const FormsOfSource forms = forms_of_source(key_values_of(info.nrrd_fields));
  if (forms.differ() && !forms.is_whole(info.geometry))
    lost.emplace_back("the source defines two positions, an sform and a qform; only the sform is written");
  return lost;
}

/// The numbers of NIfTI-1 have 32 bits.
std::string lost_by_rounding(const VolumeInfo& info) {
  constexpr double visible = 0.01;  // of a voxel
  const Geometry& geometry = info.geometry;
  if (is_second_version(info.dims)) return "";
  double smallest = INFINITY, rounding = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& d = geometry.directions[axis];
    smallest = std::min(smallest, geometry.has_directions ? std::hypot(d[0], d[1], d[2])
                                                          : std::abs(spacing_or_1(geometry, axis)));
    const double place = geometry.origin[axis];
    rounding = std::max(rounding, std::abs(place - static_cast<double>(static_cast<float>(place))));
  }
  if (!(rounding > visible * smallest)) return "";
  return fmt::format(
      "NIfTI stores 32-bit numbers, which shifts the volume by {:.2g} where samples are {:.6g} apart; the "
      ".tag file and .nrrd files have the exact position",
      rounding, smallest);
}

}  // namespace

std::unique_ptr<VolumeSink> create_nifti(const std::string& path, const VolumeInfo& info,
                                         const SinkOptions& options) {
  return std::make_unique<AttachedSink>(
      info, std::make_unique<OutputFile>(path, options.overwrite, output_options(options)), header_of(info));
}

std::unique_ptr<VolumeSink> create_nifti_gz(const std::string& path, const VolumeInfo& info,
                                            const SinkOptions& options) {
  return gzip_sink(info, std::make_unique<OutputFile>(path, options.overwrite, output_options(options)),
                   header_of(info));
}

std::vector<std::string> lost_in_nifti(const VolumeInfo& info) {
  std::vector<std::string> lost = lost_meaning(info);
  if (std::string rounding = lost_by_rounding(info); !rounding.empty()) lost.push_back(std::move(rounding));
  return lost;
}

}  // namespace tagrid
