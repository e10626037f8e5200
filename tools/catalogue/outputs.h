// What the outputs of an archive are, in its index.
#pragma once

#include <string>
#include <vector>

#include "tools/catalogue/database.h"

namespace tagrid {

/// True if there is an output in this directory or below it, or something that cannot be looked at. Throws WorldError.
bool has_outputs(const std::string& folder);

/// Looks at all outputs of an archive, and reads those that are new or were changed, with so many threads. Adds
/// sentences on what cannot be read to `remarks`.
void note_outputs(const Database& index, const std::string& folder, int threads,
                  std::vector<std::string>& remarks);

}  // namespace tagrid
