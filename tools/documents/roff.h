// The Markdown of docs/options.in as roff, the language of manual pages.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// A line of text without marks, so that roff prints it as it is.
std::string roff_text(std::string_view text);

/// Paragraphs and lists ("- "), with `code`, *words*, \* and [links](to) in them, as lines of mdoc(7). Paragraphs
/// within an item of a list are not supported.
std::string roff(std::string_view markdown);

/// "tagrid mesh --level N [-o FILE]" as lines of the synopsis.
std::string roff_form(const std::string& form);

}  // namespace tagrid
