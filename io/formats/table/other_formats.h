// Common files that tagrid does not read as volumes, and what users can do with them.
#pragma once

#include <vector>

#include "io/formats/table/formats.h"

namespace tagrid {

/// The rows of the table for formats that are only recognised.
std::vector<Format> other_formats();

}  // namespace tagrid
