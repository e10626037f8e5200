// Files that are not volumes to tagrid, but that people have: what to do with them.
#pragma once

#include <cstddef>
#include <string_view>

namespace tagrid {

inline constexpr std::size_t other_formats_peek = 352;

/// What the file that begins so is, and how its volume can be encoded; "" where it is not known.
/// `beginning`: the first other_formats_peek bytes, or all there are.
std::string_view advice_on_format(std::string_view beginning);

}  // namespace tagrid
