#include "pipeline/meshes/grid_bricks.h"

#include <fmt/format.h>

#include <vector>

#include "pipeline/grid/schedule.h"
#include "pipeline/memory/plan.h"
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
                                           {Setting{"level", "the level"}, deepest, cube_size}});
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

}  // namespace tagrid
