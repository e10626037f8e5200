// How far the mesh is from the original: the largest difference between its piecewise linear field and any
// sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// The largest |field - sample| over the samples in `measured`. The field is that of the mesh as `mesh`
/// writes it: in tetrahedra that the volume's border cuts, the field of their pieces, whose new points have
/// rounded values. Samples that are not finite do not count. If the volume is one slice, so that it has no
/// cut mesh, the field is that of the uncut tetrahedra.
///
/// For integers, the result is a quotient of exact integers, rounded once; for floats, it is computed in
/// doubles, in one order. So it is the same on every machine.
///
///   points    decoded values at the points of active.box(), x fastest; those of the active ones are read
///   active    activity of the closed box of a brick
///   original  samples of the volume
///   measured  a box in both
///   volume    all samples
template <class T>
double largest_mesh_error(std::span<const T> points, const LatticeBits& active, const Samples<T>& original,
                          const Box& measured, const Box& volume, int cube_size);

/// The same for a brick of any type that is being encoded. `values`: those of the mesh at the points of the
/// closed box of the brick; empty: the original samples. REQUIRES: `original` are the samples of that box.
double measure_mesh(const BrickSamples& original, const std::vector<std::byte>& values,
                    const LatticeBits& active, const CodingParameters& parameters, Index3 brick);

/// The peak of the heap that largest_mesh_error() takes for a brick of `size` points: the field. If the
/// border of the volume cuts tetrahedra, also a copy of the field as samples, and a bit for each point.
std::uint64_t working_bytes_of_mesh_error(SampleType type, Index3 size);

}  // namespace tagrid
