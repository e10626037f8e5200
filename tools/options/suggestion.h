// Suggests an existing name for a mistyped one.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// The candidate with the fewest insertions, deletions, replacements and swaps of neighboring letters from
/// `word`; nothing if there are more of these than a third of its letters.
std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace tagrid
