// The table of the options that say how to read an input: its format, which of several volumes to take, and
// what headerless samples are.
#pragma once

#include <string>
#include <vector>

#include "tools/options/option_row.h"

namespace tagrid {

struct SourceOptions {
  RawOptions raw;
  std::string vdb_grid, from, series, dataset;
  bool gaps_ok = false;

  /// Throws UsageError as RawOptions::description() does.
  SourceDescription description() const;
  /// True if no option was given.
  bool empty() const;
};

const std::vector<OptionRow<SourceOptions>>& source_rows();

void add_source_options(CLI::App& command, SourceOptions& options);

}  // namespace tagrid
