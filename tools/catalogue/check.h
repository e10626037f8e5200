// Checks outputs of an archive: that they are there, whole, and what was written.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/archive/events.h"
#include "tools/catalogue/catalogue.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// Which volumes of a query are checked: those first whose last check was the longest ago.
struct CheckChoice {
  double percent = 100;      ///< of the volumes
  double least_seconds = 0;  ///< since the last check
};

/// The volumes in the order in which they are checked. `now`: seconds since 1970.
std::vector<CatalogueEntry> chosen(std::vector<CatalogueEntry> entries, const CheckChoice& choice,
                                   double now);

struct Checked {
  CheckEvent event;
  bool is_repairable = false;  ///< its parity can bring it back
};

/// Reads all of an output: its size, all checksums in it, that of its record, and its parity. `decodes`: also decodes
/// it. `run` limits memory. What is wrong is in the result; the status is "unknown" if the file cannot be read. Throws
/// MemoryLimit.
Checked check_output(const std::string& path, const CatalogueEntry& entry, bool decodes,
                     const RunOptions& run);

}  // namespace tagrid
