// Places between samples.
#pragma once

#include <array>

#include "io/volume/volume_info.h"

namespace tagrid {

/// World position of a place, in samples along each axis. Like to_world() of a lattice point.
std::array<double, 3> to_world(const Geometry& geometry, const std::array<double, 3>& place);

}  // namespace tagrid
