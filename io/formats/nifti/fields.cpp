#include "io/formats/nifti/fields.h"

#include <fmt/format.h>

namespace tagrid::nifti {

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

}  // namespace tagrid::nifti
