#include "pipeline/meshes/grid_bricks.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "pipeline/decode/graph.h"
#include "pipeline/grid/schedule.h"
#include "pipeline/memory/plan.h"
#include "pipeline/threads/threads.h"
#include "stages/criterion/marking.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

// The data of a brick that the taker needs, stored until the samples of its layer are complete.
struct BrickPoints {
  Index3 position;
  LatticeBits active;             // of its closed box
  std::vector<std::byte> values;  // in a file without voxels: of all points of the box
};

// The slices of one layer of bricks, and the slice below them, which is the layer's low face.
class LayerSamples {
 public:
  explicit LayerSamples(const CodingParameters& parameters)
      : volume_(parameters.domain().volume()), size_(size_of(parameters.type)) {}

  void begin_layer(const DecodedRows& layer) {
    layer_ = &layer;
    part_ = {};
  }
  // The sample nearest to a point of the layer.
  const std::byte* at(Index3 p) {
    const Index3 q = volume_.nearest(p);
    if (q.z >= layer_->box().low.z) {
      // Nearly all points of a brick have the same owner.
      if (!part_.box.contains(q)) part_ = layer_->part_with(q);
      return part_.samples + static_cast<std::size_t>(part_.box.offset(q)) * size_;
    }
    return below_.data() +
           static_cast<std::size_t>((q.y - volume_.low.y) * volume_.size().x + q.x - volume_.low.x) * size_;
  }
  void end_layer() {
    below_.resize(layer_->slice_bytes());
    layer_->copy_slice(layer_->box().high.z, below_);
  }

 private:
  Box volume_;
  std::size_t size_;
  const DecodedRows* layer_ = nullptr;
  DecodedRows::Part part_;  // the last one that was asked for
  std::vector<std::byte> below_;
};

// The memory besides that of decoding: the taker, the bricks of a layer, and the slice below it. The header
// of a file may be wrong: sums over a layer need more than 64 bits.
std::uint64_t memory_beside_decoding(const CodingParameters& p, std::uint64_t taker_bytes) {
  const BrickGrid bricks = p.bricks();
  const Index3 size = bricks.closed_box({0, 0, 0}).size();
  const std::uint64_t points = static_cast<std::uint64_t>(size.x * size.y * size.z) * size_of(p.type);
  // The list of a layer grows by copying: it is there three times.
  const std::uint64_t brick =
      3 * sizeof(BrickPoints) + LatticeBits::working_bytes(size) + (p.mode == FileMode::grid ? points : 0);
  const double layer = static_cast<double>(bricks.bricks(0)) * static_cast<double>(bricks.bricks(1));
  const double slice =
      static_cast<double>(p.dims.x) * static_cast<double>(p.dims.y) * static_cast<double>(size_of(p.type));
  // A grid that is derived keeps slices, which memory_of_decoding() counts, and no bricks.
  const double kept = p.stores_activity() ? layer * static_cast<double>(brick) + slice : 0;
  return with_heap_overhead(kept + static_cast<double>(taker_bytes));
}

}  // namespace

int checked_level(std::optional<int> wanted, int cube_size) {
  const int deepest = max_level(cube_size);
  const int level = wanted.value_or(deepest);
  require(level >= 0 && level <= deepest, {"{} must be from 0 to {}, because root cubes have an edge of {}",
                                           Setting{"level", "the level"}, deepest, cube_size});
  return level;
}

bool is_flat(const CodingParameters& parameters) {
  const Index3& n = parameters.dims;
  return n.x == 1 || n.y == 1 || n.z == 1;
}

void refuse_flat(const CodingParameters& parameters, const std::string& name, Problem problem) {
  const Index3& n = parameters.dims;
  if (!is_flat(parameters)) return;
  throw UsageError(
      fmt::format("{}: a volume of {} x {} x {} samples is one slice or less, so it fills no space", name,
                  n.x, n.y, n.z),
      problem);
}

DecodePlan plan_taking(const CodingParameters& parameters, std::uint64_t taker_bytes,
                       const Resources& resources) {
  return plan_decoding(parameters, resources, DecodeUse::mesh,
                       memory_beside_decoding(parameters, taker_bytes));
}

namespace {

// Passes on bricks whose grid is in the file, layer by layer: values of a file with voxels are in its slices.
class StoredGrid : public RowSink {
 public:
  StoredGrid(const CodingParameters& parameters, GridTaker& taker)
      : parameters_(parameters), taker_(taker), samples_(parameters) {}

  bool takes_bricks() const override { return true; }
  void take(DecodedBrick& brick) override {
    layer_.push_back(
        {parameters_.bricks().position(brick.id), std::move(brick.active), std::move(brick.points)});
  }
  void write(const DecodedRows& layer) override {
    samples_.begin_layer(layer);
    for (BrickPoints& brick : layer_) {
      add(brick);
      brick = {};
    }
    layer_.clear();
    samples_.end_layer();
  }

 private:
  void add(const BrickPoints& brick) {
    if (parameters_.mode == FileMode::voxels) {
      taker_.add_brick(brick.position, brick.active, [&](Index3 p) { return samples_.at(p); });
      return;
    }
    taker_.add_brick(brick.position, brick.active, [&](Index3 p) {
      const auto at = static_cast<std::size_t>(brick.active.box().offset(p));
      return brick.values.data() + at * size_of(parameters_.type);
    });
  }

  const CodingParameters& parameters_;
  GridTaker& taker_;
  std::vector<BrickPoints> layer_;
  LayerSamples samples_;
};

}  // namespace

void take_all(TagReader& reader, std::uint64_t taker_bytes, const Resources& resources, GridTaker& taker,
              const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const DecodeJob job{parameters, plan_taking(parameters, taker_bytes, resources).budget,
                      BrickRows::all(parameters.bricks())};
  ProgressWatch watch(
      progress, static_cast<std::uint64_t>(parameters.domain().volume().count()) * size_of(parameters.type));
  if (parameters.stores_activity()) {
    StoredGrid stored(parameters, taker);
    return decode(job, reader, stored, watch);
  }
  DerivedGrid derived(parameters, job.rows, [&](const SubdividedBrick& brick) {
    taker.add_brick(brick.brick, brick.active, [&](Index3 p) {
      return sample_at(brick.slices, parameters.domain().volume(), size_of(parameters.type), p);
    });
  });
  RowsTo sink([&](const DecodedRows& decoded) {
    decoded.for_each_slice(derived.samples(),
                           [&](SliceSamples slice) { derived.add_slice(std::move(slice)); });
  });
  decode(job, reader, sink, watch);
}

// Passes on the bricks of a part of the grid, from the bricks that they need.

namespace {

// Decoded bricks of one layer: those of the part and, if samples are needed, those below them.
class Layer {
 public:
  Layer() = default;
  Layer(const TagBricks& file, const Box& positions, const Box& taken, Threads& threads)
      : positions_(positions), bricks_(static_cast<std::size_t>(positions.count())) {
    const BrickGrid grid = file.parameters().bricks();
    const auto position_of = [&](std::int64_t i) {
      const Index3 size = positions_.size();
      return positions_.low + Index3{i % size.x, i / size.x, 0};
    };
    std::vector<std::int64_t> ids(bricks_.size());
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = grid.id(position_of(static_cast<std::int64_t>(i)));
    file.will_read(ids);
    threads.run([&] {
      oneapi::tbb::parallel_for(std::int64_t{0}, positions.count(), [&](std::int64_t i) {
        const Index3 position = position_of(i);
        const BrickBytes block = file.read(ids[static_cast<std::size_t>(i)]);
        const Wanted wanted = taken.contains(position) ? Wanted::samples_and_grid : Wanted::samples;
        bricks_[static_cast<std::size_t>(i)] = decode_block(block, file.parameters(), file.name(), wanted);
      });
    });
  }
  const DecodedBrick& at(Index3 position) const {
    return bricks_[static_cast<std::size_t>(positions_.offset(position))];
  }
  // The samples of a box. Those that no brick of the layer owns are 0.
  SliceSamples samples(const Box& box, const BrickGrid& grid, std::size_t size) const {
    const std::shared_ptr<std::byte[]> result(
        new std::byte[memory_size(static_cast<std::uint64_t>(box.count()) * size)]());
    for (const DecodedBrick& brick : bricks_) {
      const Box owned = grid.owned_box(grid.position(brick.id)), both = intersection(owned, box);
      for (std::int64_t z = both.low.z; z <= both.high.z; ++z)
        for (std::int64_t y = both.low.y; y <= both.high.y; ++y) {
          const Index3 p{both.low.x, y, z};
          if (both.empty()) continue;
          std::memcpy(result.get() + static_cast<std::size_t>(box.offset(p)) * size,
                      brick.samples.data() + static_cast<std::size_t>(owned.offset(p)) * size,
                      static_cast<std::size_t>(both.size().x) * size);
        }
    }
    return result;
  }

 private:
  Box positions_;
  std::vector<DecodedBrick> bricks_;
};

constexpr Box nothing = {{0, 0, 0}, {-1, -1, -1}};

// The part of `box` that is in one layer.
Box layer_of(Box box, std::int64_t z) {
  box.low.z = box.high.z = z;
  return box;
}

// The bricks that the part needs. In a file with voxels, these are also those that own samples on its low
// faces; if the grid is derived, all whose samples have an influence on it.
Box needed_for(const Box& taken, const CodingParameters& parameters) {
  Box needed = taken;
  if (!parameters.stores_activity()) {
    const BrickGrid grid = parameters.bricks();
    const std::int64_t reach = parameters.cube_size + mark_halo(parameters), edge = grid.length();
    // More than the samples that are needed: bricks do not own their low faces.
    return intersection(taken.grown(reach / edge + 1),
                        Box::of_size({grid.bricks(0), grid.bricks(1), grid.bricks(2)}));
  }
  if (parameters.mode == FileMode::voxels)
    for (int axis = 0; axis < 3; ++axis) needed.low[axis] = std::max(needed.low[axis] - 1, std::int64_t{0});
  return needed;
}

// The parameters of the volume that `bricks` of a larger one make, whose domain begins at the low corner of
// their closed boxes. Its grid differs only near its border.
CodingParameters parameters_of_part(CodingParameters parameters, const Box& bricks) {
  const BrickGrid grid = parameters.bricks();
  const Index3 low = grid.closed_box(bricks.low).low;
  const Box part =
      intersection({low + grid.domain.first(), grid.closed_box(bricks.high).high}, grid.domain.volume());
  parameters.dims = part.size();
  return parameters;
}

}  // namespace

Box bricks_that_meet(const std::optional<Box>& box, const BrickGrid& bricks) {
  Box positions = Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)});
  if (!box) return positions;
  const std::int64_t length = bricks.length();
  for (int axis = 0; axis < 3; ++axis) {
    // A brick includes its last point: a box that touches a face between two bricks meets both.
    positions.low[axis] = bricks.owner(box->low[axis]);
    positions.high[axis] = std::min(box->high[axis] / length, positions.high[axis]);
  }
  return positions;
}

// Two layers of decoded bricks are in memory: the one that is passed on, and the one below.
std::uint64_t memory_of_taking(const CodingParameters& parameters, const Box& taken,
                               std::uint64_t taker_bytes, int threads) {
  const BrickGrid grid = parameters.bricks();
  const Box needed = needed_for(taken, parameters);
  const Box largest = grid.closed_box({0, 0, 0});
  const std::uint64_t sample = size_of(parameters.type);
  const auto points = static_cast<std::uint64_t>(largest.count()) * sample,
             owned = static_cast<std::uint64_t>(grid.owned_box({0, 0, 0}).count()) * sample;
  const std::uint64_t brick = sizeof(DecodedBrick) + owned + LatticeBits::working_bytes(largest.size()) +
                              (parameters.mode == FileMode::grid ? points : 0);
  const double bricks = 2 * static_cast<double>(layer_of(needed, needed.low.z).count());
  const double kept = bricks * static_cast<double>(brick) + static_cast<double>(taker_bytes);
  const std::uint64_t derived =
      parameters.stores_activity()
          ? 0
          : with_heap_overhead(DerivedGrid::memory(parameters_of_part(parameters, needed), threads));
  return memory_of_reading(parameters, threads, true) + derived + with_heap_overhead(kept);
}

int threads_for_taking(const CodingParameters& parameters, const Box& taken, std::uint64_t taker_bytes,
                       const Resources& resources) {
  return threads_within(resources, "decoding the grid of a part of the volume", [&](int threads) {
    return memory_of_taking(parameters, taken, taker_bytes, threads);
  });
}

namespace {

// The bricks with their grid, layer by layer.
void take_stored_grid(const TagBricks& file, const Box& taken, const Box& needed, GridTaker& taker,
                      Threads& threads, const std::function<void()>& layer_done) {
  const CodingParameters& parameters = file.parameters();
  const BrickGrid grid = parameters.bricks();
  const std::size_t size = size_of(parameters.type);
  const bool voxels = parameters.mode == FileMode::voxels;
  const Box volume = parameters.domain().volume();
  Layer below, layer;
  for (std::int64_t z = needed.low.z; z <= needed.high.z; ++z) {
    below = std::move(layer);
    layer = Layer(file, layer_of(needed, z), taken, threads);
    const auto sample_at = [&](Index3 p) {
      const Index3 q = volume.nearest(p);
      const Index3 owner = {grid.owner(q.x), grid.owner(q.y), grid.owner(q.z)};
      const Layer& holder = owner.z < z ? below : layer;
      return holder.at(owner).samples.data() +
             static_cast<std::size_t>(grid.owned_box(owner).offset(q)) * size;
    };
    if (z >= taken.low.z)
      for (std::int64_t y = taken.low.y; y <= taken.high.y; ++y)
        for (std::int64_t x = taken.low.x; x <= taken.high.x; ++x) {
          const DecodedBrick& brick = layer.at({x, y, z});
          if (voxels)
            taker.add_brick({x, y, z}, brick.active, sample_at);
          else
            taker.add_brick({x, y, z}, brick.active, [&](Index3 p) {
              return brick.points.data() + static_cast<std::size_t>(brick.active.box().offset(p)) * size;
            });
        }
    layer_done();
  }
}

LatticeBits moved(const LatticeBits& bits, Index3 by) {
  LatticeBits result({bits.box().low + by, bits.box().high + by});
  std::ranges::copy(bits.words(), result.words().begin());
  return result;
}

// The bricks from decoded samples, whose grid is computed for the bricks of the part alone.
void take_derived_grid(const TagBricks& file, const Box& taken, const Box& needed, GridTaker& taker,
                       Threads& threads, const std::function<void()>& layer_done) {
  const CodingParameters& parameters = file.parameters();
  const CodingParameters part = parameters_of_part(parameters, needed);
  const BrickGrid grid = parameters.bricks();
  const std::size_t size = size_of(parameters.type);
  const Index3 low = grid.closed_box(needed.low).low;
  const BrickRows rows = {taken.low.y - needed.low.y, taken.high.y - needed.low.y + 1,
                          taken.low.z - needed.low.z, taken.high.z - needed.low.z + 1};
  DerivedGrid derived(part, rows, [&](const SubdividedBrick& brick) {
    const Index3 position = brick.brick + needed.low;
    if (!taken.contains(position)) return;
    taker.add_brick(position, moved(brick.active, low),
                    [&](Index3 p) { return sample_at(brick.slices, part.domain().volume(), size, p - low); });
  });
  const Box samples = derived.samples().moved(low);
  for (std::int64_t z = needed.low.z; z <= needed.high.z; ++z) {
    const Layer layer(file, layer_of(needed, z), nothing, threads);
    const Box owned = grid.owned_box({0, 0, z});
    Box slice = samples;
    threads.run([&] {
      for (std::int64_t k = std::max(owned.low.z, samples.low.z); k <= std::min(owned.high.z, samples.high.z);
           ++k) {
        slice.low.z = slice.high.z = k;
        derived.add_slice(layer.samples(slice, grid, size));
      }
    });
    layer_done();
  }
}

}  // namespace

void take_some(const TagBricks& file, const Box& positions, std::uint64_t taker_bytes,
               const Resources& resources, GridTaker& taker, const Progress& progress) {
  const CodingParameters& parameters = file.parameters();
  const Box needed = needed_for(positions, parameters);
  Threads threads(threads_for_taking(parameters, positions, taker_bytes, resources));
  const std::uint64_t total = static_cast<std::uint64_t>(needed.size().z);
  std::uint64_t done = 0;
  const auto layer_done = [&] {
    if (progress) progress(++done, total);
  };
  const auto take = parameters.stores_activity() ? take_stored_grid : take_derived_grid;
  take(file, positions, needed, taker, threads, layer_done);
}

}  // namespace tagrid
