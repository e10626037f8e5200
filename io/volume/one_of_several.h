// Files that hold several volumes, one after the other.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// The number, from 0 on, of the volume that `series` numbers from 1 on; without it, of the only one. `name` of the file, and
/// what `each` volume is, are for messages. Throws UsageError if there are several and none is named, or if there is no such volume.
std::int64_t number_of_volume(const std::string& name, const std::string& series, std::int64_t volumes,
                              const std::string& each);

}  // namespace tagrid
