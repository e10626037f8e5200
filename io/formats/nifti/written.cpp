// NIfTI headers of volumes that are written.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "io/bytes/little_endian.h"
#include "io/formats/nifti/fields.h"
#include "io/formats/nifti/header.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"
#include "io/text/text.h"
#include "io/volume/one_of_volumes.h"

namespace tagrid {
namespace {

using namespace nifti;

using Matrix = std::array<std::array<double, 3>, 3>;  // [axis of the volume][axis of the world]

/// A header of either version, as bytes.
class HeaderBytes {
 public:
  explicit HeaderBytes(bool is_second) : is_second_(is_second), bytes_(is_second ? 544 : 352, '\0') {}

  void put(const Field& field, double number, std::size_t i = 0) {
    const Place& place = is_second_ ? field.second : field.first;
    switch (place.type) {
      case 'b':
        return store(place.at + i, static_cast<std::uint8_t>(number));
      case 's':
        return store(place.at + i * 2, static_cast<std::int16_t>(number));
      case 'i':
        return store(place.at + i * 4, static_cast<std::int32_t>(number));
      case 'l':
        return store(place.at + i * 8, static_cast<std::int64_t>(number));
      case 'f':
        return store(place.at + i * 4, static_cast<float>(number));
      default:
        return store(place.at + i * 8, number);
    }
  }
  void put_text(const Field& field, std::string_view text) {
    std::memcpy(bytes_.data() + (is_second_ ? field.second : field.first).at, text.data(), text.size());
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

/// Codes of the standard: coordinates of the scanner, and others.
constexpr double in_scanner = 1, aligned = 2;

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
    for (std::size_t axis = 0; axis < 3; ++axis) header.put(srow[row], placement.directions[axis][row], axis);
    header.put(srow[row], placement.origin[row], 3);
  }
  header.put(sform_code, code);
}

void put_qform(HeaderBytes& header, const std::array<double, 3>& bcd, const std::array<double, 3>& origin,
               double code) {
  header.put(qform_code, code);
  for (std::size_t i = 0; i < 3; ++i) {
    header.put(quatern, bcd[i], i);
    header.put(qoffset, origin[i], i);
  }
}

/// What a NIfTI source said in a field; the others stay 0.
void put_pair(HeaderBytes& header, const Field& field, const Pairs& pairs) {
  const auto found = pairs.find(fmt::format("nifti_{}", field.name));
  if (found == pairs.end()) return;
  // A text ends with a 0.
  if (field.first.type == 'c') return header.put_text(field, found->second.substr(0, field.count - 1));
  if (field.count == 1) return header.put(field, number_of(found->second).value_or(0));
  for (std::size_t i = 0; const std::string_view word : words_of(found->second)) {
    if (i == field.count) break;
    header.put(field, number_of(word).value_or(0), i++);
  }
}

/// Fields of a NIfTI source that say nothing about its place.
void put_other_fields(HeaderBytes& header, const Pairs& pairs, const Index3& dims) {
  for (const Field& field : {cal_min, cal_max, intent_code, dim_info, slice_code, slice_duration, intent_p,
                             descrip, aux_file, intent_name})
    put_pair(header, field, pairs);
  // It is the time of volume 0 of several.
  if (!pairs.contains(std::string(volume_name_key))) put_pair(header, toffset, pairs);
  // In a part of the source, they would name slices that do not exist.
  const auto slice_in = [&](const char* key) {
    const auto found = pairs.find(key);
    return found == pairs.end() ? 0 : number_of(found->second).value_or(0);
  };
  const double start = slice_in("nifti_slice_start"), end = slice_in("nifti_slice_end");
  if (start >= 0 && end < static_cast<double>(dims.z) && start <= end) {
    header.put(slice_start, start);
    header.put(slice_end, end);
  }
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
  header.put(pixdim, qfac);
  for (std::size_t axis = 0; axis < 3; ++axis) header.put(pixdim, spacing[axis], axis + 1);
}

/// The axes of several volumes, as they were in a NIfTI source of as many. `unit`: the code of that of lengths.
void put_volumes(HeaderBytes& header, const Pairs& pairs, std::int64_t volumes, int unit) {
  header.put(dim, 4);
  header.put(dim, static_cast<double>(volumes), 4);
  const auto numbers = [&](const Field& field) {
    std::vector<double> all;
    if (const auto found = pairs.find(fmt::format("nifti_{}", field.name)); found != pairs.end())
      for (const std::string_view word : words_of(found->second)) all.push_back(number_of(word).value_or(0));
    all.resize(field.count);
    return all;
  };
  const std::vector<double> sizes = numbers(dim), steps = numbers(pixdim), units = numbers(xyzt_units);
  double product = 1;
  for (std::size_t i = 4; i < 8; ++i) product *= static_cast<double>(i) <= sizes[0] ? sizes[i] : 1;
  if (product == static_cast<double>(volumes))
    for (std::size_t i : {0, 4, 5, 6, 7}) header.put(dim, sizes[i], i);
  for (std::size_t i = 4; i < 8; ++i) header.put(pixdim, steps[i], i);
  constexpr int of_time = 0x38;
  const int time = units[0] >= 0 && units[0] < 256 ? static_cast<int>(units[0]) & of_time : 0;
  header.put(xyzt_units, unit | time);
}

/// NIfTI-2 is for sizes that NIfTI-1 cannot have.
bool is_second_version(const Index3& dims) { return std::max({dims.x, dims.y, dims.z}) > 32767; }

/// What a header cannot say.
std::vector<std::string> lost_meaning(const VolumeInfo& info) {
  std::vector<std::string> lost = lost_places(
      info.geometry(),
      {.name = "NIfTI", .space = "right-anterior-superior", .unknown_unit = "the spacing has none"});
  const FormsOfSource forms = forms_of_source(info.metadata.pairs());
  if (forms.differ() && !forms.is_whole(info.geometry()))
    lost.emplace_back("the source defines two positions, an sform and a qform; only the sform is written");
  return lost;
}

/// The numbers of NIfTI-1 have 32 bits.
std::string lost_by_rounding(const VolumeInfo& info) {
  constexpr double visible = 0.01;  // of a voxel
  const Geometry& geometry = info.geometry();
  if (is_second_version({info.dims.x, info.dims.y, info.dims.z / info.volumes})) return "";
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

std::string nifti_header_bytes(const VolumeInfo& info) {
  const auto listed = info.metadata.pairs();
  Pairs pairs(listed.begin(), listed.end());
  if (const auto loss = pairs.find(std::string(lossy_source_key)); loss != pairs.end()) {
    std::string& text = pairs[fmt::format("nifti_{}", descrip.name)];
    text = TextWithLoss{text, loss->second}.joined(descrip.count - 1);
  }
  const Index3 dims = {info.dims.x, info.dims.y, info.dims.z / info.volumes};
  const bool is_second = is_second_version(dims);
  HeaderBytes header(is_second);
  header.put(sizeof_hdr, is_second ? 540 : 348);
  header.put_text(magic, is_second ? std::string_view("n+2\0\r\n\032\n", 8) : std::string_view("n+1\0", 4));
  const std::array<double, 8> sizes = {
      3, static_cast<double>(dims.x), static_cast<double>(dims.y), static_cast<double>(dims.z), 1, 1, 1, 1};
  for (std::size_t i = 0; i < 8; ++i) header.put(dim, sizes[i], i);
  header.put(datatype, std::ranges::find(datatypes, info.type, &std::pair<int, SampleType>::second)->first);
  header.put(bitpix, 8 * static_cast<double>(size_of(info.type)));
  header.put(vox_offset, is_second ? 544 : 352);
  const Rescale rescale = info.metadata.rescale();
  header.put(scl_slope, rescale.slope);
  header.put(scl_inter, rescale.intercept);
  put_other_fields(header, pairs, dims);
  const Geometry geometry = geometry_in_file(info.geometry());
  header.put(xyzt_units, code_of_unit(geometry));
  put_place(header, geometry, forms_of_source(listed));
  if (info.volumes > 1) put_volumes(header, pairs, info.volumes, code_of_unit(geometry));
  return header.bytes();
}

std::vector<std::string> lost_in_nifti(const VolumeInfo& info) {
  std::vector<std::string> lost = lost_meaning(info);
  if (std::string rounding = lost_by_rounding(info); !rounding.empty()) lost.push_back(std::move(rounding));
  return lost;
}

}  // namespace tagrid
