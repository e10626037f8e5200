// Makes text from outside safe to print.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// `text` without anything on which a terminal would act. Control characters (including those of Unicode that
/// take two bytes, and those that change the direction of writing) and bytes that are not UTF-8 become \n,
/// \t, \r, or \xHH for each of their bytes. All other text stays as it is.
std::string printable(std::string_view text);

/// The name of an input or an output in messages: its path, or "standard input" or "standard output" for "-".
std::string shown_input(const std::string& path);
std::string shown_output(const std::string& path);

/// A name of a file as UTF-8, such as JSON needs, from which name_of_text() makes the same bytes again. A byte that is not
/// UTF-8 becomes U+FFFD and its two hexadecimal digits, and so does every byte of U+FFFD itself.
std::string text_of_name(std::string_view name);
/// The name for such a text.
std::string name_of_text(std::string_view text);

}  // namespace tagrid
