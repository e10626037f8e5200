// The meshes with materials of a reader of the library.
#include <span>
#include <string>
#include <vector>

#include "io/bytes/little_endian.h"
#include "pipeline/library/calls.h"
#include "pipeline/materials/material_mesh.h"
#include "pipeline/materials/settings.h"

using namespace tagrid;
using namespace tagrid::library;

namespace {

MeshLength length_of(double length) { return {length, ""}; }

MaterialMeshOptions options_of(const tagrid_material_mesh_options& given, const Index3& dims) {
  MaterialMeshOptions options;
  options.counts_edges = false;
  require(given.materials != nullptr || given.material_count == 0,
          "there are no materials, but their number is not 0");
  require(given.labels != 0 || given.material_count > 0, "a mesh with materials needs materials");
  if (given.labels != 0) options.labels.emplace().smoothing = given.smoothing;
  for (std::size_t i = 0; i < given.material_count; ++i) {
    const tagrid_material& material = given.materials[i];
    require(material.name != nullptr, "a material has no name");
    if (!options.labels)
      options.ranges.push_back({material.name, material.low, material.high});
    else
      require(options.labels->names.emplace(material.label, material.name).second,
              "two materials have the same label");
  }
  if (given.fine != 0) options.fine = length_of(given.fine);
  if (given.coarse != 0) options.coarse = length_of(given.coarse);
  options.prefers_angles = given.best_angles != 0;
  options.order = given.order;
  options.parts = {given.largest_parts != 0, given.least_volume};
  if (given.box != nullptr) {
    const Box box = box_of(*given.box, dims);
    for (int axis = 0; axis < 3; ++axis) {
      options.region.low[static_cast<std::size_t>(axis)] = box.low[axis];
      options.region.high[static_cast<std::size_t>(axis)] = box.high[axis] + 1;
    }
  }
  return options;
}

// Calls use(numbers, count) for pieces of an array of rows, from row `first` on.
template <class Number, class Use>
void pass(SpoolFile& file, std::size_t row, std::int64_t first, std::int64_t count, Use use) {
  std::vector<Number> numbers;
  for_each_piece(file, row * sizeof(Number), first, count,
                 [&](std::int64_t, std::span<const std::byte> piece) {
                   numbers.resize(piece.size() / sizeof(Number));
                   for (std::size_t i = 0; i < numbers.size(); ++i)
                     numbers[i] = load_little_endian<Number>(piece.data() + i * sizeof(Number));
                   if (use(numbers.data(), numbers.size() / row) != 0) cancel();
                 });
}

void pass(MaterialMesh& mesh, const tagrid_material_mesh_sink& sink) {
  pass<double>(mesh.points, 3, 0, mesh.point_count(),
               [&](const double* xyz, std::size_t count) { return sink.points(sink.user, count, xyz); });
  for (const MaterialElements& material : mesh.materials)
    pass<std::int64_t>(mesh.nodes, mesh.nodes_of_element(), material.first, material.count,
                       [&](const std::int64_t* nodes, std::size_t count) {
                         return sink.tetrahedra(sink.user, material.name.c_str(), material.label, count,
                                                nodes);
                       });
  for (const MaterialSurface& surface : mesh.surfaces)
    pass<std::int64_t>(mesh.face_nodes, mesh.nodes_of_face(), surface.first, surface.count,
                       [&](const std::int64_t* nodes, std::size_t count) {
                         return sink.triangles(sink.user, surface.name.c_str(), count, nodes);
                       });
}

}  // namespace

tagrid_status tagrid_reader_material_mesh(const tagrid_reader* reader,
                                          const tagrid_material_mesh_options* given_options,
                                          const tagrid_material_mesh_sink* given_sink,
                                          const tagrid_call* given) {
  return with_file(reader, [&](const TagBricks& file) {
    require(given_options != nullptr && given_sink != nullptr,
            "a mesh with materials needs options and a sink");
    const tagrid_material_mesh_sink sink =
        taken_over(given_sink, tagrid_material_mesh_sink_init, sizeof *given_sink);
    require(sink.points != nullptr && sink.tetrahedra != nullptr && sink.triangles != nullptr,
            "the sink of a mesh with materials needs functions for points, tetrahedra and triangles");
    const tagrid_material_mesh_options taken =
        taken_over(given_options, tagrid_material_mesh_options_init, sizeof *given_options);
    const MaterialMeshOptions options = options_of(taken, file.parameters().dims);
    const tagrid_call settings = settings_of(given);
    const Geometry geometry = file.header().metadata.geometry();
    const MaterialMeshJob job = settle_material_mesh(file, geometry, options);
    MadeMaterialMesh made = make_material_mesh(file, job, geometry, options,
                                               {taken.folder != nullptr ? taken.folder : "/tmp", file.name()},
                                               resources_of(settings), 0, progress_of(settings));
    pass(made.mesh, sink);
  });
}
