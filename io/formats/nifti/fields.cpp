#include "io/formats/nifti/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "io/metadata/fields.h"
#include "io/metadata/foreign_geometry.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

namespace tagrid::nifti {
namespace {

bool spans_a_volume(const Geometry& geometry) {
  for (const auto& direction : geometry.directions)
    for (const double number : direction)
      if (!std::isfinite(number)) return false;
  const double volume = determinant(geometry.directions);
  return std::isfinite(volume) && volume != 0;
}

Geometry geometry_of_sform(const Fields& fields) {
  Geometry geometry;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      geometry.directions[axis][row] = fields.number(srow[row], axis);
    geometry.origin[row] = fields.number(srow[row], 3);
  }
  return geometry;
}

Geometry geometry_of_qform(const Fields& fields) {
  return tagrid::geometry_of_qform(fields.numbers<3>(quatern), fields.numbers<3>(qoffset),
                                   fields.numbers<4>(pixdim));
}

/// A way in which a header says where a volume lies.
struct Form {
  std::string_view name;
  const Field* code;
  Geometry (*geometry)(const Fields& fields);
  std::vector<const Field*> said_by;
};

/// "srow_x 1 0 0 5, srow_y 0 1 0 5", for messages.
std::string text_of(const Fields& fields, const std::vector<const Field*>& names) {
  std::string text;
  for (const Field* field : names) {
    const std::string value = fields.text(*field);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", field->name, value.empty() ? "0" : value);
  }
  return text;
}

/// The geometry of the form; nothing if the header lacks it, or if it is unusable, which adds a warning.
std::optional<Geometry> geometry_of_form(const Form& form, const Fields& fields,
                                         std::vector<std::string>& warnings) {
  if (fields.integer(*form.code) <= 0) return std::nullopt;
  Geometry geometry = form.geometry(fields);
  if (!spans_a_volume(geometry)) {
    warnings.push_back(fmt::format("NIfTI header: the {} does not span a volume, and is not used: {}",
                                   form.name, text_of(fields, form.said_by)));
    return std::nullopt;
  }
  geometry.has_directions = geometry.has_origin = true;
  geometry.space = "right-anterior-superior";
  if (!std::ranges::all_of(geometry.origin, [](double number) { return std::isfinite(number); })) {
    warnings.push_back(
        fmt::format("NIfTI header: the position in the {} is not a number, and where the volume "
                    "lies is unknown: {}",
                    form.name, text_of(fields, form.said_by)));
    geometry.has_origin = false;
    geometry.origin = {};
  }
  return geometry;
}

/// The sizes of voxels. Along axes with one sample, they have no meaning.
Geometry geometry_of_pixdim(const Fields& fields, const Index3& dims, std::vector<std::string>& warnings) {
  std::vector<ForeignNumber> sizes;
  std::vector<std::string> names;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // "pixdim must be positive": other readers take a negative one for its absolute value, too.
    const double size = std::abs(fields.number(pixdim, axis + 1));
    const bool says_nothing = !(size > 0) && dims[static_cast<int>(axis)] == 1;
    sizes.push_back(says_nothing ? ForeignNumber() : foreign_number(size));
    names.push_back(fmt::format("NIfTI header: pixdim[{}]", axis + 1));
  }
  Geometry geometry;
  set_spacing(sizes, names, NegativeSpacing::is_unknown, geometry, warnings);
  return geometry;
}

void check_signs(const Fields& fields, std::vector<std::string>& warnings) {
  for (std::size_t axis = 1; axis <= 3; ++axis)
    if (const double size = fields.number(pixdim, axis); size < 0)
      warnings.push_back(fmt::format("NIfTI header: pixdim[{}], the size of voxels, is {}; it is read as {}",
                                     axis, size, -size));
}

}  // namespace

std::string Fields::text(const Field& field) const {
  if (place_of(field).type == 'c') {
    const std::string_view text = bytes_.substr(place_of(field).at, field.count);
    return std::string(text.substr(0, text.find('\0')));
  }
  std::string text;
  bool is_zero = true;
  for (std::size_t i = 0; i < field.count; ++i) {
    is_zero = is_zero && number(field, i) == 0;
    text += fmt::format("{}{}", i > 0 ? " " : "", number(field, i));
  }
  return is_zero ? "" : text;
}

Geometry geometry_of_fields(const Fields& fields, const Index3& dims, std::vector<std::string>& warnings) {
  const Form sform{"sform", &sform_code, geometry_of_sform, {&srow[0], &srow[1], &srow[2]}};
  const Form qform{"qform", &qform_code, geometry_of_qform, {&quatern, &qoffset, &pixdim}};
  auto geometry = geometry_of_form(sform, fields, warnings);
  if (!geometry) {
    check_signs(fields, warnings);
    geometry = geometry_of_form(qform, fields, warnings);
  }
  if (!geometry) geometry = geometry_of_pixdim(fields, dims, warnings);
  const auto unit = static_cast<std::size_t>(fields.integer(xyzt_units) & 7);
  if (unit > units_of_nifti.size())
    warnings.push_back(fmt::format("NIfTI header: xyzt_units has the unit {}, which is not known", unit));
  else if (unit > 0)
    geometry->units.fill(std::string(units_of_nifti[unit - 1]));
  return *geometry;
}

}  // namespace tagrid::nifti

namespace tagrid {
namespace {

/// Numbers of a form went through float32, and those of a rotation through a quaternion.
bool is_same_place(const Geometry& a, const Geometry& b) {
  double scale = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t row = 0; row < 3; ++row)
      scale = std::max({scale, std::abs(a.directions[axis][row]), std::abs(b.directions[axis][row])});
  const double of_directions = 1e-5 * scale;
  for (std::size_t row = 0; row < 3; ++row) {
    const double far = std::max(std::abs(a.origin[row]), std::abs(b.origin[row]));
    if (!(std::abs(a.origin[row] - b.origin[row]) <= 1e-3 * scale + 1e-6 * far)) return false;
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!(std::abs(a.directions[axis][row] - b.directions[axis][row]) <= of_directions)) return false;
  }
  return true;
}

}  // namespace

Geometry geometry_of_qform(const std::array<double, 3>& quatern, const std::array<double, 3>& qoffset,
                           const std::array<double, 4>& pixdim) {
  const auto [b, c, d] = quatern;
  const double rest = 1 - (b * b + c * c + d * d);
  const double a = rest > 0 ? std::sqrt(rest) : 0;
  // With a = 0, the other three are to have the length 1.
  const double length = rest > 0 ? 1 : std::sqrt(b * b + c * c + d * d);
  const double i = b / length, j = c / length, k = d / length;
  const std::array<std::array<double, 3>, 3> rotation = {
      {{a * a + i * i - j * j - k * k, 2 * (i * j - a * k), 2 * (i * k + a * j)},
       {2 * (i * j + a * k), a * a + j * j - i * i - k * k, 2 * (j * k - a * i)},
       {2 * (i * k - a * j), 2 * (j * k + a * i), a * a + k * k - i * i - j * j}}};
  Geometry geometry;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Only pixdim[0] mirrors. The others must be positive; readers take a negative one for its absolute
    // value.
    const double size = std::abs(pixdim[axis + 1]) * (axis == 2 && pixdim[0] < 0 ? -1 : 1);
    for (std::size_t row = 0; row < 3; ++row) geometry.directions[axis][row] = rotation[row][axis] * size;
  }
  geometry.origin = qoffset;
  return geometry;
}

bool FormsOfSource::differ() const { return has_sform() && has_qform() && !is_same_place(sform, qform); }

bool FormsOfSource::is_whole(const Geometry& geometry) const {
  return geometry.has_directions && is_same_place(sform, geometry);
}

FormsOfSource forms_of_source(const std::vector<std::pair<std::string, std::string>>& pairs) {
  const std::map<std::string, std::string> texts(pairs.begin(), pairs.end());
  const auto number = [&](const char* key, std::size_t i) {
    const auto found = texts.find(key);
    if (found == texts.end()) return 0.0;  // fields that are 0 are not kept
    const auto words = words_of(found->second);
    return i < words.size() ? number_of(words[i]).value_or(0) : 0.0;
  };
  FormsOfSource forms;
  forms.is_nifti = texts.contains("nifti_pixdim");
  forms.sform_code = number("nifti_sform_code", 0);
  forms.qform_code = number("nifti_qform_code", 0);
  constexpr std::array rows = {"nifti_srow_x", "nifti_srow_y", "nifti_srow_z"};
  for (std::size_t i = 0; i < 3; ++i) {
    forms.quatern[i] = number("nifti_quatern_bcd", i);
    forms.qoffset[i] = number("nifti_qoffset_xyz", i);
    for (std::size_t axis = 0; axis < 3; ++axis) forms.sform.directions[axis][i] = number(rows[i], axis);
    forms.sform.origin[i] = number(rows[i], 3);
  }
  for (std::size_t i = 0; i < 4; ++i) forms.pixdim[i] = number("nifti_pixdim", i);
  forms.qform = geometry_of_qform(forms.quatern, forms.qoffset, forms.pixdim);
  return forms;
}

}  // namespace tagrid
