#include "io/formats/nifti/forms.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "io/text/text.h"

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
