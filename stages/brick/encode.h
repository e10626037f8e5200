// Encodes one brick of any sample type to its bytes. The type of the samples is chosen here. The inverse is
// decode.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/brick/codec.h"
#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// The samples of `box` as bytes, stored as in memory, in the type of the volume, x fastest.
struct BrickSamples {
  Box box;
  std::vector<std::byte> bytes;
};

/// See mark_tile() in stages/marks/tile.h.
LatticeBits mark_tile(const BrickSamples& samples, const Box& cubes, const Box& marked,
                      const CodingParameters& parameters);

/// See encode_brick() in stages/brick/codec.h.
void encode_brick(const BrickSamples& samples, const LatticeBits& active, const CodingParameters& parameters,
                  Index3 brick, BrickCode& code);

/// The largest distance between the mesh in a brick and the original samples of its closed box. `values` are
/// the values of the mesh at the points of the closed box; empty: the original samples. See
/// largest_mesh_error().
double measure_mesh(const BrickSamples& original, const std::vector<std::byte>& values,
                    const LatticeBits& active, const CodingParameters& parameters, Index3 brick);

}  // namespace tagrid
