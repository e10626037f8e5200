#include "io/volume/plain_form.h"

#include "io/text/text.h"

namespace tagrid {

std::string plain_name(std::string_view name) {
  const std::string lower = lower_case(name);
  // A file that is called ".gz" keeps its name.
  const auto has_ending = [&](std::string_view ending) {
    return lower.ends_with(ending) && lower.size() > ending.size() &&
           lower[lower.size() - ending.size() - 1] != '/';
  };
  for (const std::string_view ending : {".gz", ".bz2"})
    if (has_ending(ending)) return std::string(name.substr(0, name.size() - ending.size()));
  if (has_ending(".zraw"))
    return std::string(name.substr(0, name.size() - 4)).append(name.substr(name.size() - 3));
  return std::string(name);
}

}  // namespace tagrid
