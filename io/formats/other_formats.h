// Files that are not volumes to tagrid, but that people have: what to do with them.
#pragma once

#include <vector>

#include "io/formats/formats.h"

namespace tagrid {

/// Rows of the table that are only recognised.
std::vector<Format> other_formats();

}  // namespace tagrid
