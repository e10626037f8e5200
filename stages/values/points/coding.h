// Codes the values of the active points of a brick as bytes; a file without voxels stores nothing else of its
// samples.
//
// A value is stored on a fixed lattice, as a multiple of 2 E_n + 1 clamped to the type, and not relative to a
// prediction: so both bricks at a shared face store the same value there. Points come coarse to fine. Each is
// predicted from the vertices of its diamond, all of which are active and known.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/status.h"

namespace tagrid {

/// The stored value for `value`, if points may be wrong by `point_error`.
template <class T>
T stored_point(T value, std::int64_t point_error);

/// Appends the values of the active points of active.box(). `values` holds the stored values (see
/// stored_point) of all its points, x fastest; those of inactive points are ignored. REQUIRES: the box
/// consists of complete root cubes, and the set of active points is conforming inside it.
template <class T>
void encode_points(std::span<const T> values, const LatticeBits& active, int cube_size,
                   std::int64_t point_error, std::vector<std::uint8_t>& out);

/// The inverse: sets the values of the active points. Safe on any bytes.
template <class T>
Status decode_points(std::span<const std::uint8_t> bytes, const LatticeBits& active, int cube_size,
                     std::int64_t point_error, std::span<T> values);

/// The peak of the heap that encode_points() takes for a box of `size` points, including the bytes that it
/// appends: the models, and the largest possible number of events.
std::uint64_t working_bytes_of_encoding_points(SampleType type, Index3 size);
/// The same for decode_points(): the models.
std::uint64_t working_bytes_of_decoding_points(Index3 size);

}  // namespace tagrid
