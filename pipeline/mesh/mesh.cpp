#include "pipeline/mesh/mesh.h"

#include <fmt/format.h>

#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/mesh/vtu_writer.h"
#include "io/nrrd/geometry.h"
#include "pipeline/decode/graph.h"
#include "pipeline/memory/plan.h"
#include "pipeline/mesh/point_ids.h"
#include "stages/grid/lattice.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/points/field.h"

namespace tagrid {
namespace {

// What the mesh needs of a brick until the samples of its layer are there.
struct BrickPoints {
  Index3 position;
  LatticeBits active;             // of its closed box
  std::vector<std::byte> values;  // of a file without voxels: of all points of the box
};

// The slices of one layer of bricks, and the one below them, which is the layer's low face.
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

// The field at all points of a brick, as samples. `value_of(p)` points to the value of a lattice point.
template <class ValueOf>
std::vector<std::byte> field_of(const LatticeBits& grid, const CodingParameters& parameters,
                                ValueOf value_of) {
  std::vector<std::byte> bytes;
  with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    const Box& box = grid.box();
    std::vector<T> points;
    points.reserve(static_cast<std::size_t>(box.count()));
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
        for (std::int64_t x = box.low.x; x <= box.high.x; ++x) {
          T value;
          std::memcpy(&value, value_of({x, y, z}), sizeof value);
          points.push_back(value);
        }
    const auto field = interpolate_points<T>(points, grid, parameters.cube_size);
    const std::vector<T> samples = rounded_field<T>(field, points, grid, parameters.cube_size);
    const auto all = std::as_bytes(std::span(samples));
    bytes.assign(all.begin(), all.end());
  });
  return bytes;
}

// Makes tetrahedra of bricks, in their order.
class MeshBuilder {
 public:
  MeshBuilder(const TagHeader& header, int level, bool padded, VtuWriter& writer)
      : parameters_(header.parameters),
        geometry_(geometry_of(header.nrrd_fields)),
        mirrored_(is_mirrored(geometry_)),
        level_(level),
        padded_(padded),
        ids_(parameters_.bricks()),
        writer_(writer) {}

  // `value_of(p)` points to the value of a lattice point of the brick.
  template <class ValueOf>
  void add_brick(const BrickPoints& brick, ValueOf value_of) {
    const Box& box = brick.active.box();
    ids_.begin_brick(brick.position);
    if (padded_ || parameters_.domain().volume().contains(box))
      add_leaves(brick.active, value_of);
    else
      add_cut_leaves(brick.active, value_of);
    ids_.end_brick();
    flush();
  }

 private:
  static constexpr std::size_t batch = std::size_t{1} << 16;  // tetrahedra that wait for the writer

  template <class ValueOf>
  void add_leaves(const LatticeBits& active, ValueOf& value_of) {
    for_each_leaf_tetrahedron(active, active.box(), parameters_.cube_size, level_,
                              [&](const Tetrahedron& t) { add_tetrahedron(t.vertices, t.level, value_of); });
  }

  template <class ValueOf>
  void add_cut_leaves(const LatticeBits& active, ValueOf& value_of) {
    // Of a prefix the field is another one.
    const LatticeBits grid = prefix_of(active, parameters_.cube_size, level_);
    const std::vector<std::byte> field = field_of(grid, parameters_, value_of);
    const std::size_t size = size_of(parameters_.type);
    const auto field_at = [&](Index3 p) {
      return field.data() + static_cast<std::size_t>(grid.box().offset(p)) * size;
    };
    const Index3 last = parameters_.domain().volume().high;
    for_each_leaf_tetrahedron(grid, grid.box(), parameters_.cube_size, level_, [&](const Tetrahedron& t) {
      if (!reaches_beyond(t.vertices, last)) return add_tetrahedron(t.vertices, t.level, field_at);
      for (const auto& piece : cut_at(t.vertices, last)) add_tetrahedron(piece, t.level, field_at);
    });
  }

  template <class ValueOf>
  void add_tetrahedron(const std::array<Index3, 4>& vertices, int level, ValueOf& value_of) {
    std::array<std::int64_t, 4> ids;
    for (std::size_t i = 0; i < 4; ++i) ids[i] = id_of(vertices[i], value_of);
    if (mirrored_) std::swap(ids[2], ids[3]);
    connectivity_.insert(connectivity_.end(), ids.begin(), ids.end());
    levels_.push_back(static_cast<std::uint8_t>(level));
    if (levels_.size() == batch) flush();
  }

  template <class ValueOf>
  std::int64_t id_of(Index3 p, ValueOf& value_of) {
    std::int64_t& id = ids_.of(p);
    if (id == PointIds::none) {
      id = next_id_++;
      const std::array<double, 3> world = to_world(geometry_, p);
      coordinates_.insert(coordinates_.end(), world.begin(), world.end());
      const std::byte* value = value_of(p);
      values_.insert(values_.end(), value, value + size_of(parameters_.type));
    }
    return id;
  }

  void flush() {
    writer_.add_points(coordinates_, values_);
    writer_.add_tetrahedra(connectivity_, levels_);
    coordinates_.clear();
    values_.clear();
    connectivity_.clear();
    levels_.clear();
  }

  const CodingParameters& parameters_;
  Geometry geometry_;
  bool mirrored_;
  int level_;
  bool padded_;
  PointIds ids_;
  std::int64_t next_id_ = 0;
  VtuWriter& writer_;
  std::vector<double> coordinates_;
  std::vector<std::byte> values_;
  std::vector<std::int64_t> connectivity_;
  std::vector<std::uint8_t> levels_;
};

int checked_level(const MeshOptions& options, int cube_size) {
  const int deepest = max_level(cube_size);
  const int level = options.level.value_or(deepest);
  if (level < 0 || level > deepest)
    throw UsageError(Sentence{"{} must be 0 .. {}, as root cubes have an edge of {}",
                              {Setting{"level", "the level"}, deepest, cube_size}});
  return level;
}

void refuse_flat(const TagReader& reader, bool padded) {
  const Index3& n = reader.parameters().dims;
  if (padded || (n.x > 1 && n.y > 1 && n.z > 1)) return;
  throw UsageError(
      fmt::format("{}: a volume of {} x {} x {} samples is one slice, or less, and fills no space",
                  reader.name(), n.x, n.y, n.z),
      Problem::mesh_fills_no_space);
}

// Layer by layer, as the values of a file with voxels are in its slices.
void mesh_bricks(TagReader& reader, MeshBuilder& mesh, const DecodeBudget& budget, const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const std::uint64_t total =
      static_cast<std::uint64_t>(parameters.domain().volume().count()) * size_of(parameters.type);
  std::uint64_t done = 0;
  std::vector<BrickPoints> layer;
  LayerSamples samples(parameters);

  const auto add_brick = [&](const BrickPoints& brick) {
    if (parameters.mode == FileMode::voxels) {
      mesh.add_brick(brick, [&](Index3 p) { return samples.at(p); });
      return;
    }
    mesh.add_brick(brick, [&](Index3 p) {
      const auto at = static_cast<std::size_t>(brick.active.box().offset(p));
      return brick.values.data() + at * size_of(parameters.type);
    });
  };
  DecodeStreams streams;
  streams.name = reader.name();
  streams.read_brick = [&](BrickBytes& brick) { return reader.read_brick(brick); };
  streams.inspect_brick = [&](const DecodedBrick& brick) {
    layer.push_back({parameters.bricks().position(brick.id), brick.active, brick.points});
  };
  streams.write_rows = [&](const DecodedRows& decoded) {
    samples.begin_layer(decoded);
    for (BrickPoints& brick : layer) {
      add_brick(brick);
      brick = {};
    }
    layer.clear();
    samples.end_layer();
    done += decoded.bytes();
    if (progress) progress(done, total);
  };
  run_decode_graph(parameters, BrickRows::all(parameters.bricks()), budget, streams);
}

}  // namespace

MeshResult write_mesh(const std::string& input, const std::string& output, const MeshOptions& options,
                      const Resources& resources, const Progress& progress,
                      const BeforeNaming<MeshResult>& before_naming) {
  if (output != "-" && !output.ends_with(".vtu"))
    throw UsageError(output + ": a mesh is written as VTU; its name must end in .vtu");
  refuse_same_file(input, output);
  check_output(output, options.overwrite);
  TagReader reader(input);
  const CodingParameters& parameters = reader.parameters();
  const int level = checked_level(options, parameters.cube_size);
  refuse_flat(reader, options.padded);
  const DecodePlan plan = plan_decoding(parameters, resources, DecodeUse::mesh);
  VtuWriter writer(output, parameters.type, options.overwrite);
  MeshBuilder mesh(reader.header(), level, options.padded, writer);
  mesh_bricks(reader, mesh, plan.budget, progress);
  writer.finish();
  const MeshResult result = {reader.header(),     reader.index(),       reader.sizes().file,
                             writer.file_bytes(), writer.point_count(), writer.tetrahedron_count()};
  if (before_naming) before_naming(result);
  writer.commit();
  return result;
}

}  // namespace tagrid
