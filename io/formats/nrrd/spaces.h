// What the names of coordinate systems mean.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace tagrid {

/// For each axis of the world: +1 if it runs to the right, to the front, or up; -1 if it runs the other way. Nothing if the
/// name ("left-posterior-superior", "LPS") does not say it, or not in this order.
std::optional<std::array<int, 3>> signs_of_space(const std::string& space);

/// "LPS" for "left-posterior-superior", and such. Another name has its letters, digits and '-' alone, at most 32 of them.
std::string short_name_of_space(const std::string& space);

}  // namespace tagrid
