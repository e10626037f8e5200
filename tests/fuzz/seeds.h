// Inputs to begin with: parts of the golden files, small files made for the purpose, and texts.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tagrid::fuzz {

using Seeds = std::vector<std::vector<std::uint8_t>>;

/// By the name of their target. `golden` is the directory of the golden files.
std::map<std::string, Seeds> make_seeds(const std::string& golden);

}  // namespace tagrid::fuzz
