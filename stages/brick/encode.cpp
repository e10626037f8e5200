#include "stages/brick/encode.h"

#include <span>

#include "stages/marks/tile.h"
#include "stages/mesh/mesh_error.h"
#include "stages/volume/sample_type.h"
#include "stages/volume/samples.h"

namespace tagrid {
namespace {

template <class T>
Samples<T> view_of(const BrickSamples& samples) {
  return {samples.box, reinterpret_cast<const T*>(samples.bytes.data())};
}

}  // namespace

LatticeBits mark_tile(const BrickSamples& samples, const Box& cubes, const Box& marked,
                      const CodingParameters& parameters) {
  return with_sample_type(parameters.type, [&](auto type) {
    return mark_tile(view_of<decltype(type)>(samples), cubes, marked, parameters);
  });
}

void encode_brick(const BrickSamples& samples, const LatticeBits& active, const CodingParameters& parameters,
                  Index3 brick, BrickCode& code) {
  with_sample_type(parameters.type, [&](auto type) {
    encode_brick(view_of<decltype(type)>(samples), active, parameters, brick, code);
  });
}

double measure_mesh(const BrickSamples& original, const std::vector<std::byte>& values,
                    const LatticeBits& active, const CodingParameters& parameters, Index3 brick) {
  const std::vector<std::byte>& of_mesh = values.empty() ? original.bytes : values;
  return with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    const std::span<const T> points(reinterpret_cast<const T*>(of_mesh.data()), of_mesh.size() / sizeof(T));
    return largest_mesh_error<T>(points, active, view_of<T>(original), parameters.bricks().owned_box(brick),
                                 parameters.dims, parameters.cube_size);
  });
}

}  // namespace tagrid
