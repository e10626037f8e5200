// Passes the bricks of a .tag file's grid, with the values of points, to a consumer: a mesh or a surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/decode/graph.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// A pointer to the value of a lattice point of a brick, in the sample type; valid until the next call.
/// Outside the volume, it is that of the nearest decoded sample, or the stored value.
using ValueOf = std::function<const std::byte*(Index3)>;

/// The level up to which the grid is used: `wanted`, or all. Throws UsageError if the grid cannot have it.
int checked_level(std::optional<int> wanted, int cube_size);

/// True if the volume is at most one slice, so that it fills no space.
bool is_flat(const CodingParameters& parameters);
/// Throws UsageError, with this code, if the volume of the file `name` is flat.
void refuse_flat(const CodingParameters& parameters, const std::string& name, Problem problem);

class GridTaker {
 public:
  virtual ~GridTaker() = default;

  /// Takes the next brick, in the order of their numbers. `active`: the activity of its closed box.
  virtual void add_brick(Index3 position, const LatticeBits& active, const ValueOf& value_of) = 0;
};

/// The plan of take_all() with a taker that has up to `taker_bytes` on the heap. Throws MemoryLimit.
DecodePlan plan_taking(const CodingParameters& parameters, std::uint64_t taker_bytes,
                       const Resources& resources);

/// Passes all bricks of a file that has not been read yet. Memory: that of decoding, the activity of a layer
/// of bricks, and the taker's. Throws BrokenInput, WorldError, MemoryLimit, and those of `taker` and
/// `progress`.
void take_all(TagReader& reader, std::uint64_t taker_bytes, const Resources& resources, GridTaker& taker,
              const Progress& progress = {});

/// The bricks whose closed boxes meet `box`, as a box of positions; without a box, all bricks.
Box bricks_that_meet(const std::optional<Box>& box, const BrickGrid& bricks);

/// The memory of take_some() with a number of threads.
std::uint64_t memory_of_taking(const CodingParameters& parameters, const Box& positions,
                               std::uint64_t taker_bytes, int threads);

/// The most threads that may decode in take_some(). Throws MemoryLimit if not even one may.
int threads_for_taking(const CodingParameters& parameters, const Box& positions, std::uint64_t taker_bytes,
                       const Resources& resources);

/// Passes the bricks at `positions`. Also reads those below, which own samples on their low faces. Memory:
/// two layers of these bricks, and the taker's. Progress counts layers. Throws as take_all() does.
void take_some(const TagBricks& file, const Box& positions, std::uint64_t taker_bytes,
               const Resources& resources, GridTaker& taker, const Progress& progress = {});

/// Builds `part` with a MeshBuilder or a SurfaceBuilder, made of the file's header, positions, `part` and
/// `more`. Memory and exceptions: as take_all(). REQUIRES: no box; the grid has the level of the part.
template <class Builder, class Part, class... More>
void build_all(TagReader& reader, const Part& part, const Resources& resources, const Progress& progress,
               More&... more) {
  const CodingParameters& parameters = reader.parameters();
  const Box positions = bricks_that_meet(part.box, parameters.bricks());
  Builder builder(reader.header(), positions, part, more...);
  take_all(reader, Builder::working_bytes(parameters, positions), resources, builder, progress);
}

/// The same with take_some(), for a part with a box. REQUIRES: the box is within the volume.
template <class Builder, class Part, class... More>
void build_box(const TagBricks& file, const Part& part, const Resources& resources, const Progress& progress,
               More&... more) {
  const CodingParameters& parameters = file.parameters();
  const Box positions = bricks_that_meet(part.box, parameters.bricks());
  Builder builder(file.header(), positions, part, more...);
  take_some(file, positions, Builder::working_bytes(parameters, positions), resources, builder, progress);
}

}  // namespace tagrid
