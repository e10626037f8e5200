// Characters of Unicode as UTF-8.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// Adds a character, which has one to four bytes. REQUIRES: code < 0x200000.
void append_utf8(std::uint32_t code, std::string& text);

}  // namespace tagrid
