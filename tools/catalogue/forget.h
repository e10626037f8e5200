// Removes volumes from an archive: outputs, records, entries of the index, and names.
#pragma once

#include <string>
#include <vector>

#include "tools/catalogue/catalogue.h"

namespace tagrid {

struct Forgotten {
  std::size_t outputs = 0;           ///< files that were removed
  std::uint64_t bytes = 0;           ///< of these
  std::size_t records = 0;           ///< lines that were removed
  std::vector<std::string> unknown;  ///< lines that are no records, and may name the volumes
  std::vector<std::string> found;    ///< files and paths of the archive that still have a name of the volumes
};

/// Forgets these volumes of an archive. Records go last: a run that is killed can be repeated. Then searches every byte
/// of what stays, but for .tag files of other volumes, for the names. Throws HeldByAnother if a run adds to the records,
/// and WorldError.
Forgotten forget(const Catalogue& catalogue, const std::vector<CatalogueEntry>& entries);

}  // namespace tagrid
