// Text that may have come from anywhere, for people to read.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// `text` without anything that a terminal would act on. Control characters (also those of Unicode that are
/// written as two bytes, and those that turn the direction of writing), and bytes that are not UTF-8, become
/// \n, \t, \r or \xHH for each of their bytes. All else stays.
std::string printable(std::string_view text);

}  // namespace tagrid
