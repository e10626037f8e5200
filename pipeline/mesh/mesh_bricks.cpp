#include "pipeline/mesh/mesh_bricks.h"

#include <algorithm>
#include <vector>

#include "pipeline/decode/graph.h"
#include "pipeline/grid/derived_grid.h"
#include "pipeline/memory/of_bricks.h"

namespace tagrid {
namespace {

// The data of a brick that the mesh needs, stored until the samples of its layer are complete.
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

  void begin_layer(const DecodedRows& layer) { layer_ = &layer; }
  // The sample nearest to a point of the layer.
  const std::byte* at(Index3 p) const {
    const Index3 q = volume_.nearest(p);
    if (q.z >= layer_->box().low.z) return layer_->at(q);
    return below_.data() + static_cast<std::size_t>(q.y * volume_.size().x + q.x) * size_;
  }
  void end_layer() {
    below_.resize(layer_->slice_bytes());
    layer_->copy_slice(layer_->box().high.z, below_);
  }

 private:
  Box volume_;
  std::size_t size_;
  const DecodedRows* layer_ = nullptr;
  std::vector<std::byte> below_;
};

// The memory of making the mesh besides that of decoding: the builder, the bricks of a layer, and the slice
// below it. The header of a file may be wrong: sums over a layer need more than 64 bits.
std::uint64_t memory_beside_decoding(const CodingParameters& p) {
  const BrickGrid bricks = p.bricks();
  const Index3 size = bricks.closed_box({0, 0, 0}).size();
  const std::uint64_t points = static_cast<std::uint64_t>(size.x * size.y * size.z) * size_of(p.type);
  // The list of a layer grows by copying: it is there three times.
  const std::uint64_t brick =
      3 * sizeof(BrickPoints) + LatticeBits::working_bytes(size) + (p.mode == FileMode::grid ? points : 0);
  const double layer = static_cast<double>(bricks.bricks(0)) * static_cast<double>(bricks.bricks(1));
  const double slice =
      static_cast<double>(p.dims.x) * static_cast<double>(p.dims.y) * static_cast<double>(size_of(p.type));
  const Box all = Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)});
  // A grid that is derived keeps slices, which memory_of_decoding() counts, and no bricks.
  const double kept = p.stores_grid() ? layer * static_cast<double>(brick) + slice : 0;
  const double bytes = kept + static_cast<double>(MeshBuilder::working_bytes(p, all));
  return static_cast<std::uint64_t>(std::min(bytes * heap_overhead, 4e18));
}

}  // namespace

DecodePlan plan_mesh(const CodingParameters& parameters, const Resources& resources) {
  return plan_decoding(parameters, resources, DecodeUse::mesh, memory_beside_decoding(parameters));
}

bool is_flat(const CodingParameters& parameters, const MeshPart& part) {
  const Index3& n = parameters.dims;
  return !part.padded && (n.x == 1 || n.y == 1 || n.z == 1);
}

namespace {

// Makes the mesh from bricks whose grid is in the file, layer by layer: values of a file with voxels are in its slices.
class StoredGridMesh {
 public:
  StoredGridMesh(const CodingParameters& parameters, MeshBuilder& mesh)
      : parameters_(parameters), mesh_(mesh), samples_(parameters) {}

  void take(DecodedBrick& brick) {
    layer_.push_back(
        {parameters_.bricks().position(brick.id), std::move(brick.active), std::move(brick.points)});
  }
  void end_layer(const DecodedRows& decoded) {
    samples_.begin_layer(decoded);
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
      mesh_.add_brick(brick.position, brick.active, [&](Index3 p) { return samples_.at(p); });
      return;
    }
    mesh_.add_brick(brick.position, brick.active, [&](Index3 p) {
      const auto at = static_cast<std::size_t>(brick.active.box().offset(p));
      return brick.values.data() + at * size_of(parameters_.type);
    });
  }

  const CodingParameters& parameters_;
  MeshBuilder& mesh_;
  std::vector<BrickPoints> layer_;
  LayerSamples samples_;
};

}  // namespace

void mesh_all(TagReader& reader, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const DecodePlan plan = plan_mesh(parameters, resources);
  MeshBuilder mesh(reader.header(), part, sink);
  const Watch watch = watch_for(
      progress, static_cast<std::uint64_t>(parameters.domain().volume().count()) * size_of(parameters.type));
  DecodeStreams streams;
  streams.bricks = reader.bricks();
  StoredGridMesh stored(parameters, mesh);
  DerivedGrid derived(parameters, BrickRows::all(parameters.bricks()), [&](const SubdividedBrick& brick) {
    mesh.add_brick(brick.brick, brick.active, [&](Index3 p) {
      return sample_at(brick.slices, parameters.dims, size_of(parameters.type), p);
    });
  });
  if (parameters.stores_grid()) streams.inspect_brick = [&](DecodedBrick& brick) { stored.take(brick); };
  streams.write_rows = [&](const DecodedRows& decoded) {
    if (parameters.stores_grid())
      stored.end_layer(decoded);
    else
      decoded.for_each_slice(derived.samples(),
                             [&](SliceSamples slice) { derived.add_slice(std::move(slice)); });
    watch.done(decoded.bytes());
  };
  run_decode_graph(parameters, BrickRows::all(parameters.bricks()), plan.budget, streams);
}

}  // namespace tagrid
