// Bounds on errors: of voxels, of active voxels, of the mesh, and of stored points.
#pragma once

#include <cmath>

namespace tagrid {

/// True if `e` can bound an error: a finite number from 0, in sample units. An absent bound is nothing in
/// EncodeOptions, and -1 in CodingParameters and in the header: see docs/decisions/0020-bounds.md.
inline bool is_bound(double e) { return e >= 0 && std::isfinite(e); }

}  // namespace tagrid
