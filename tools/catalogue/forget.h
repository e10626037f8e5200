// Removes volumes from an archive: outputs, records, entries of the index, and names.
#pragma once

#include <string>
#include <vector>

#include "tools/catalogue/catalogue.h"
#include "tools/catalogue/records_editor.h"

namespace tagrid {

struct Forgotten {
  std::size_t outputs = 0;           ///< files that were removed
  std::uint64_t bytes = 0;           ///< of these
  std::size_t records = 0;           ///< lines that were removed
  std::vector<std::string> unknown;  ///< lines that cannot be read, and may name the volumes
  std::vector<std::string> found;    ///< files and paths of the archive that still have a name of the volumes
};

/// Forgets these volumes of an archive, whose records are held by `records`. First it checks all that could end it, and
/// writes the new records; then it removes the outputs; the records get their names last, so that a run that is killed can
/// be repeated. Then it searches every byte of what stays, but for the outputs of other volumes, for names of the volumes.
/// Throws UsageError if an output is not what the catalogue says, and WorldError.
Forgotten forget(const Catalogue& catalogue, const std::vector<CatalogueEntry>& entries,
                 RecordsEditor& records);

}  // namespace tagrid
