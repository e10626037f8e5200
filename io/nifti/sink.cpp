#include "io/nifti/sink.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "io/bytes/little_endian.h"
#include "io/files/text.h"
#include "io/nrrd/geometry.h"
#include "io/nrrd/rescale.h"
#include "io/nrrd/spaces.h"
#include "io/samples/file_sink.h"
#include "io/samples/gzip_sink.h"

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

double form_code(const Pairs& pairs, const char* name, double otherwise) {
  const double code = number_in(pairs, name, otherwise);
  return code >= 1 ? code : otherwise;
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
  header.put<float, double>(128, 200, number_in(pairs, "nifti_cal_min", 0));
  header.put<float, double>(124, 192, number_in(pairs, "nifti_cal_max", 0));
  header.put<std::int16_t, std::int32_t>(68, 504, number_in(pairs, "nifti_intent_code", 0));
  header.put<std::uint8_t, std::uint8_t>(39, 524, number_in(pairs, "nifti_dim_info", 0));
  if (const auto text = pairs.find("nifti_descrip"); text != pairs.end())
    header.put_text(148, 240, 79, text->second);
  if (const auto text = pairs.find("nifti_intent_name"); text != pairs.end())
    header.put_text(328, 508, 15, text->second);

  const Geometry& geometry = info.geometry;
  const std::string unit = lower_case(geometry.units[0]);
  header.put<std::uint8_t, std::int32_t>(123, 500,
                                         unit == "m"                    ? 1
                                         : unit == "mm"                 ? 2
                                         : unit == "um" || unit == "µm" ? 3
                                                                        : 0);
  std::array<double, 3> spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) spacing[axis] = std::abs(spacing_or_1(geometry, axis));
  double qfac = 1;
  Geometry placed = geometry;
  // Without a form, programs put the volume wherever they like, and a part of it elsewhere. A file that had none gets none.
  const bool had_no_form = pairs.contains("nifti_pixdim") && !pairs.contains("nifti_sform_code") &&
                           !pairs.contains("nifti_qform_code");
  const bool is_at_zero = !placed.has_origin && placed.origin == Geometry().origin;
  const double code = placed.has_directions || !placed.space.empty() ? in_scanner : aligned;
  if (!placed.has_directions && !(had_no_form && is_at_zero)) {
    for (std::size_t axis = 0; axis < 3; ++axis) placed.directions[axis][axis] = spacing_or_1(geometry, axis);
    placed.has_directions = true;
  }
  if (placed.has_directions) {
    const Placement placement = placement_of(placed);
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        header.put<float, double>(280 + 16 * row + 4 * axis, 400 + 32 * row + 8 * axis,
                                  placement.directions[axis][row]);
      header.put<float, double>(292 + 16 * row, 424 + 32 * row, placement.origin[row]);
    }
    header.put<std::int16_t, std::int32_t>(254, 348, form_code(pairs, "nifti_sform_code", code));
    if (const auto rotation = rotation_of(placement.directions, spacing)) {
      qfac = rotation->qfac;
      header.put<std::int16_t, std::int32_t>(252, 344, form_code(pairs, "nifti_qform_code", code));
      for (std::size_t i = 0; i < 3; ++i) {
        header.put<float, double>(256 + 4 * i, 352 + 8 * i, rotation->bcd[i]);
        header.put<float, double>(268 + 4 * i, 376 + 8 * i, placement.origin[i]);
      }
    }
  }
  header.put<float, double>(76, 104, qfac);
  for (std::size_t axis = 0; axis < 3; ++axis)
    header.put<float, double>(80 + 4 * axis, 112 + 8 * axis, spacing[axis]);
  return header.bytes();
}

/// What a header cannot say.
std::string lost_meaning(const VolumeInfo& info) {
  const Geometry& geometry = info.geometry;
  const std::string unit = lower_case(geometry.units[0]);
  if (!unit.empty() && unit != "m" && unit != "mm" && unit != "um" && unit != "µm")
    return fmt::format("NIfTI does not know the unit {}, so the spacing has none",
                       tagrid::quoted(std::string_view(unit)));
  if (has_unknown_spacing(geometry)) return "NIfTI cannot say that a spacing is not known; 1 is written";
  if ((geometry.has_directions || geometry.has_origin) && !signs_of_space(geometry.space))
    return fmt::format(
        "NIfTI means right-anterior-superior; the space of the volume is {}, and its positions are written "
        "as "
        "they are",
        geometry.space.empty() ? "not known" : tagrid::quoted(geometry.space));
  return "";
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
      "the numbers of NIfTI have 32 bits, which moves the place of the volume by {:.2g}, of {:.6g} between "
      "samples; "
      "the .tag file and .nrrd files have the exact place",
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
  return std::make_unique<GzipSink>(
      info, std::make_unique<OutputFile>(path, options.overwrite, output_options(options)), header_of(info));
}

std::string lost_in_nifti(const VolumeInfo& info) {
  const std::string meaning = lost_meaning(info), place = lost_by_rounding(info);
  return meaning + (meaning.empty() || place.empty() ? "" : "; ") + place;
}

}  // namespace tagrid
