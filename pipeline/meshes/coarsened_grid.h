// The coarsest grid whose mesh is within a bound of all decoded voxels, found brick by brick.
//
// A brick is refined by itself (stages/coarsen/coarsen.h) and again whenever a neighbor has made a point
// active that both contain, until nothing changes. What is found is the one smallest grid, so the order of
// the bricks, their size and the number of threads have no influence on it. Samples and activity of bricks
// wait in nameless temporary files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "io/files/spool_file.h"
#include "io/tag/file.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/decode/graph.h"
#include "pipeline/grid/slices.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "stages/coarsen/coarsen.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// A brick of the coarsened grid.
struct CoarsenedBrick {
  LatticeBits active;              ///< of its closed box
  std::vector<std::byte> samples;  ///< at the points of this box, outside the volume of the nearest voxel
};

class CoarsenedGrid {
 public:
  /// `parameters` must outlive the object. `path`: for messages, and the directory of temporary files.
  CoarsenedGrid(const CodingParameters& parameters, const MeshBound& bound, const std::string& path);

  /// The heap that it takes with a number of threads: slices of a layer of bricks, a few bytes for each
  /// brick, and the samples and activity of the bricks on which threads work.
  static std::uint64_t working_bytes(const CodingParameters& parameters, std::int64_t threads);
  /// The heap of a CoarsenedBrick.
  static std::uint64_t bytes_of_brick(const CodingParameters& parameters);

  /// Takes the samples of the next layer of bricks, and refines each of them, on the threads of the caller's
  /// arena. REQUIRES: layer.complete(), with all rows of bricks of the layer.
  void add_layer(const DecodedRows& layer);
  /// Refines bricks on the threads of the caller's arena until nothing changes. Call it after the last layer.
  void settle();
  /// REQUIRES: settle() was called.
  CoarsenedBrick brick(Index3 position);

 private:
  using Samples = std::vector<std::byte>;

  void add_brick(std::int64_t id, const SliceRange& slices);
  void refine_again(std::int64_t id);
  LatticeBits with_news(std::int64_t id, LatticeBits active);
  void refine(std::int64_t id, const Samples& samples, LatticeBits expanded, LatticeBits active);
  std::uint32_t concerned(std::int64_t id, const LatticeBits& known, const LatticeBits& active) const;

  LatticeBits read_bits(std::int64_t id);
  void write_bits(std::int64_t id, const LatticeBits& bits);
  Box box_of(std::int64_t id) const { return bricks_.closed_box(bricks_.position(id)); }

  const CodingParameters& parameters_;
  MeshBound bound_;
  BrickGrid bricks_;
  Box all_;  ///< positions of bricks
  SliceWindow window_;
  std::int64_t next_layer_ = 0;
  std::mutex mutex_;  ///< for all below
  SpoolFile samples_, bits_;
  std::vector<std::uint32_t> news_;  ///< by brick, a bit for each neighbor with points new to it
};

struct CoarseningPlan {
  DecodePlan decoding;
  int threads = 1;  ///< that refine bricks
};

/// The plan of coarsen_file() with a taker that has up to `taker_bytes` on the heap. Throws MemoryLimit.
CoarseningPlan plan_coarsening(const CodingParameters& parameters, std::uint64_t taker_bytes,
                               const Resources& resources);

/// Takes a brick of the grid. `value_of` returns a pointer to the decoded sample at a lattice point of the
/// brick's closed box, as its type lies in memory; outside the volume, to the nearest one.
using TakeCoarsened = std::function<void(Index3 position, const LatticeBits& active,
                                         const std::function<const std::byte*(Index3)>& value_of)>;

/// Decodes a file that has not been read yet, finds the coarsest grid within `bound` of its decoded voxels,
/// whatever grid it stores, and passes the bricks at `positions` in order. Memory: that of decoding, a second
/// copy of a layer of slices, and a few bricks for each thread. Nameless files beside `path` take the bytes
/// of the samples. Throws BrokenInput, WorldError, MemoryLimit, and those of `take` and `progress`.
void coarsen_file(TagReader& reader, const MeshBound& bound, const Box& positions, const std::string& path,
                  std::uint64_t taker_bytes, const Resources& resources, const TakeCoarsened& take,
                  const Progress& progress = {});

}  // namespace tagrid
