#include "pipeline/mesh/mesh_bricks.h"

#include <vector>

#include "pipeline/decode/graph.h"
#include "pipeline/memory/plan.h"

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

}  // namespace

bool is_flat(const CodingParameters& parameters, const MeshPart& part) {
  const Index3& n = parameters.dims;
  return !part.padded && (n.x == 1 || n.y == 1 || n.z == 1);
}

// Works layer by layer, as the values of a file with voxels are in its slices.
void mesh_all(TagReader& reader, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const DecodePlan plan = plan_decoding(parameters, resources, DecodeUse::mesh);
  MeshBuilder mesh(reader.header(), part, sink);
  const Watch watch = watch_for(
      progress, static_cast<std::uint64_t>(parameters.domain().volume().count()) * size_of(parameters.type));
  std::vector<BrickPoints> layer;
  LayerSamples samples(parameters);

  const auto add_brick = [&](const BrickPoints& brick) {
    if (parameters.mode == FileMode::voxels) {
      mesh.add_brick(brick.position, brick.active, [&](Index3 p) { return samples.at(p); });
      return;
    }
    mesh.add_brick(brick.position, brick.active, [&](Index3 p) {
      const auto at = static_cast<std::size_t>(brick.active.box().offset(p));
      return brick.values.data() + at * size_of(parameters.type);
    });
  };
  DecodeStreams streams;
  streams.bricks = reader.bricks();
  streams.inspect_brick = [&](DecodedBrick& brick) {
    layer.push_back(
        {parameters.bricks().position(brick.id), std::move(brick.active), std::move(brick.points)});
  };
  streams.write_rows = [&](const DecodedRows& decoded) {
    samples.begin_layer(decoded);
    for (BrickPoints& brick : layer) {
      add_brick(brick);
      brick = {};
    }
    layer.clear();
    samples.end_layer();
    watch.done(decoded.bytes());
  };
  run_decode_graph(parameters, BrickRows::all(parameters.bricks()), plan.budget, streams);
}

}  // namespace tagrid
