// Codes the values of the active points of a brick as bytes; a file without voxels stores nothing else of its
// samples.
//
// A value is stored on a fixed lattice, and not relative to a prediction: so both bricks at a shared face
// store the same value there. Integers are stored as multiples of 2 E_n + 1, clamped to the type. Floats are
// stored as multiples of 2 E_n, rounded to the type, if these are within E_n, and otherwise as they are; if
// E_n = 0, every float is stored as it is. Points come coarse to fine. Each is predicted from the vertices of
// its diamond, all of which are active and known.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/status.h"

namespace tagrid {

/// The stored value for `value`, if points may be wrong by `point_error`. Values that are not finite stay as
/// they are. T: the sample types, here and below.
template <class T>
T stored_point(T value, double point_error);

/// Appends the values of the active points of active.box(). `values` holds the stored values (see
/// stored_point) of all its points, x fastest; those of inactive points are ignored. REQUIRES: the box
/// consists of complete root cubes, and the set of active points is conforming inside it.
template <class T>
void encode_points(std::span<const T> values, const LatticeBits& active, int cube_size, double point_error,
                   std::vector<std::uint8_t>& out);

/// The inverse: sets the values of the active points. Safe on any bytes.
template <class T>
Status decode_points(std::span<const std::uint8_t> bytes, const LatticeBits& active, int cube_size,
                     double point_error, std::span<T> values);

/// The peak of the heap that encode_points() takes for a box of `size` points, including the bytes that it
/// appends: what decode_points() takes, and the largest possible number of events.
std::uint64_t working_bytes_of_encoding_points(SampleType type, Index3 size);
/// The same for decode_points(): the models, and for wide types the numbers of the points.
std::uint64_t working_bytes_of_decoding_points(SampleType type, Index3 size);

}  // namespace tagrid
