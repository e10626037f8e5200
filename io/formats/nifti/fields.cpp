#include "io/formats/nifti/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "io/formats/nifti/forms.h"
#include "io/metadata/fields.h"
#include "io/metadata/foreign_geometry.h"
#include "io/text/foreign_number.h"

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
