// What somebody meant who wrote something that does not exist.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// The candidate that is the fewest insertions, deletions, replacements and swaps of neighbouring letters
/// away from `word`; nothing where that is more than a third of its letters.
std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace tagrid
