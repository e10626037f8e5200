// The meshes and surfaces of a reader of the library.
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "io/meshes/sinks.h"
#include "pipeline/library/calls.h"
#include "pipeline/meshes/mesh_builder.h"
#include "pipeline/meshes/surface_builder.h"
#include "stages/grid/lattice.h"

using namespace tagrid;
using namespace tagrid::library;

namespace {

// Passes the mesh to the caller.
class CallbackMesh : public MeshSink {
 public:
  CallbackMesh(const tagrid_mesh_sink& sink, std::size_t sample_size) : sink_(sink), size_(sample_size) {}
  void add_points(std::span<const double> xyz, std::span<const std::byte> values) override {
    if (xyz.empty()) return;
    if (sink_.points(sink_.user, values.size() / size_, xyz.data(), values.data()) != 0) cancel();
  }
  void add_tetrahedra(std::span<const std::int64_t> points, std::span<const std::uint8_t> levels) override {
    if (levels.empty()) return;
    if (sink_.tetrahedra(sink_.user, levels.size(), points.data(), levels.data()) != 0) cancel();
  }

 private:
  tagrid_mesh_sink sink_;
  std::size_t size_;
};

// Passes the surface to the caller.
class CallbackSurface : public SurfaceSink {
 public:
  explicit CallbackSurface(const tagrid_surface_sink& sink) : sink_(sink) {}
  void add(const SurfacePiece& piece) override {
    xyz_.clear();
    ids_.clear();
    const std::int64_t known = points_;
    for (std::size_t i = 0; i < piece.ids.size(); ++i) {
      if (piece.ids[i] < known) continue;
      const std::array<double, 3> place = piece.position(i);
      xyz_.insert(xyz_.end(), place.begin(), place.end());
      ++points_;
    }
    for (const auto& triangle : piece.triangles)
      for (const std::uint32_t vertex : triangle) ids_.push_back(piece.ids[vertex]);
    if (!xyz_.empty() && sink_.points(sink_.user, xyz_.size() / 3, xyz_.data()) != 0) cancel();
    if (!ids_.empty() && sink_.triangles(sink_.user, ids_.size() / 3, ids_.data()) != 0) cancel();
  }

 private:
  tagrid_surface_sink sink_;
  std::int64_t points_ = 0;
  std::vector<double> xyz_;
  std::vector<std::int64_t> ids_;
};

int level_of(int level, const CodingParameters& parameters) {
  const int deepest = max_level(parameters.cube_size);
  require(level >= -1 && level <= deepest, "the grid has no such level");
  return level == -1 ? deepest : level;
}

SurfacePart part_of_surface(const tagrid_surface_options& options, const CodingParameters& parameters) {
  SurfacePart part;
  part.level = level_of(options.level, parameters);
  part.close = options.close != 0;
  if (options.box != nullptr) part.box = parameters.domain().points_of(box_of(*options.box, parameters.dims));
  require(!is_flat(parameters), "a volume of one slice has no surface");
  return part;
}

MeshPart part_of(const tagrid_mesh_options* given, const CodingParameters& parameters) {
  const tagrid_mesh_options options = taken_over(given, tagrid_mesh_options_init, sizeof *given);
  MeshPart part = {level_of(options.level, parameters), options.padded != 0};
  if (options.box != nullptr) part.box = parameters.domain().points_of(box_of(*options.box, parameters.dims));
  require(part.padded || !is_flat(parameters),
          "a volume of one slice or less fills no space; only its padded mesh, of complete root cubes, does");
  return part;
}

// Builds a part from the bricks that it needs, or all from front to back.
template <class Builder, class Part, class... More>
void build(const tagrid_reader& reader, const Part& part, const tagrid_call* given, More&... more) {
  const tagrid_call settings = settings_of(given);
  if (part.box)
    return build_box<Builder>(*reader.file, part, resources_of(settings), progress_of(settings), more...);
  TagReader stream(std::make_unique<SourceStream>(reader.source));
  build_all<Builder>(stream, part, resources_of(settings), progress_of(settings), more...);
}

}  // namespace

tagrid_status tagrid_reader_mesh(const tagrid_reader* reader, const tagrid_mesh_options* options,
                                 const tagrid_mesh_sink* given_sink, const tagrid_call* given) {
  return with_file(reader, [&](const TagBricks& file) {
    require(given_sink != nullptr, "there is no sink for the mesh");
    const tagrid_mesh_sink functions = taken_over(given_sink, tagrid_mesh_sink_init, sizeof *given_sink);
    require(functions.points != nullptr && functions.tetrahedra != nullptr,
            "the sink of a mesh needs functions for points and for tetrahedra");
    const MeshPart part = part_of(options, file.parameters());
    CallbackMesh sink(functions, size_of(file.parameters().type));
    build<MeshBuilder>(*reader, part, given, sink);
  });
}

tagrid_status tagrid_reader_surface(const tagrid_reader* reader, double iso,
                                    const tagrid_surface_options* given_options,
                                    const tagrid_surface_sink* given_sink, const tagrid_call* given) {
  return with_file(reader, [&](const TagBricks& file) {
    require(given_sink != nullptr, "there is no sink for the surface");
    const tagrid_surface_sink functions =
        taken_over(given_sink, tagrid_surface_sink_init, sizeof *given_sink);
    require(functions.points != nullptr && functions.triangles != nullptr,
            "the sink of a surface needs functions for points and for triangles");
    require(std::isfinite(iso), "the value of a surface must be a finite number");
    const tagrid_surface_options options =
        taken_over(given_options, tagrid_surface_options_init, sizeof *given_options);
    const SurfacePart part = part_of_surface(options, file.parameters());
    const SurfaceLevel level =
        options.rescaled != 0 ? surface_level(iso, file.header(), file.name()) : SurfaceLevel{iso, false};
    CallbackSurface sink(functions);
    build<SurfaceBuilder>(*reader, part, given, level, sink);
  });
}
