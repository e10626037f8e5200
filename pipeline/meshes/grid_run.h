// What write_mesh() and write_surface() are asked for and give back: each writes a form of the grid of a .tag
// file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/tag/file.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

template <class Options>
struct GridRun {
  std::string input;   ///< the .tag file; "-": the standard input
  std::string output;  ///< its name chooses the format; "-": the standard output, in the first of the formats
  Options options = {};
  Resources resources{1};
  Progress progress = {};
};

struct GridResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;              ///< of the .tag file
  std::uint64_t bytes_out = 0;             ///< of the output
  std::vector<std::string> warnings = {};  ///< what the user should know of the output
};

}  // namespace tagrid
