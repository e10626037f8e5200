// Makes text from outside safe to print.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// `text` without anything on which a terminal would act. Control characters (including those of Unicode that
/// take two bytes, and those that change the direction of writing) and bytes that are not UTF-8 become \n,
/// \t, \r, or \xHH for each of their bytes. All other text stays as it is.
std::string printable(std::string_view text);

}  // namespace tagrid
