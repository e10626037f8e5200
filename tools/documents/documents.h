// The documents that tagrid_documents writes.
#pragma once

#include <string>
#include <vector>

#include "tools/documents/command_line_table.h"
#include "tools/documents/texts.h"

namespace tagrid {

/// The manual page: `frame`, the content of docs/tagrid.1.in, with the commands and options at its marks.
std::string manual_page(const std::string& frame, const Texts& texts, const std::vector<Command>& commands);

/// The reference, docs/options.md: a heading for each command and each option.
std::string reference(const Texts& texts, const std::vector<Command>& commands);

/// The completions of shells, as files that are installed.
std::string bash_completion(const std::vector<Command>& commands);
std::string zsh_completion(const std::vector<Command>& commands);

}  // namespace tagrid
