// Names in the order in which people count.
#pragma once

#include <string_view>

namespace tagrid {

/// True if `a` comes before `b` in natural order: digits in a row count as one number, so that slice9 comes before
/// slice10. Names that differ only in leading zeros are ordered by them, so this is an order of all texts.
bool comes_before(std::string_view a, std::string_view b);

}  // namespace tagrid
