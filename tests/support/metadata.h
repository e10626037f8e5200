// Descriptions of volumes from their text, for tests.
#pragma once

#include <string>

#include "io/metadata/text.h"

namespace tagrid {

inline Geometry geometry_of(const std::string& text) { return parse_metadata(text).geometry(); }

}  // namespace tagrid
