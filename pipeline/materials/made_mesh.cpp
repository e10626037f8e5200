#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/metadata/foreign_geometry.h"
#include "pipeline/materials/bricks.h"
#include "pipeline/materials/material_mesh.h"
#include "pipeline/materials/plan.h"

namespace tagrid {
namespace {

MaterialMesh empty_mesh(const Geometry& geometry, const MaterialMeshJob& job, const SpoolPlace& place) {
  return {job.settings.order,
          {short_name_of_space(geometry.space), {}, job.fine},
          job.unit,
          {},
          {},
          place.file(),
          place.file(),
          place.file(),
          place.file()};
}

// What is kept but has no tetrahedra.
void warn_of_missing(const MaterialMeshJob& job, const TagBricks& samples, MadeMaterialMesh& result,
                     bool are_all_named, bool are_labels) {
  if (!are_all_named) return;
  const auto& total = samples.index().total;
  const Rescale rescale = are_labels ? Rescale{} : samples.header().metadata.rescale();
  const double low = rescale.slope * total.low + rescale.intercept;
  const double high = rescale.slope * total.high + rescale.intercept;
  const std::string values = fmt::format("; {} are from {:.6g} to {:.6g}", are_labels ? "labels" : "values",
                                         std::min(low, high), std::max(low, high));
  for (const auto& [material, known_name] : job.names.names) {
    if (!job.settings.keeps(material)) continue;
    const std::string& name = known_name;
    const auto is_it = [&](const MaterialElements& m) { return m.name == name && m.count > 0; };
    if (std::none_of(result.mesh.materials.begin(), result.mesh.materials.end(), is_it))
      result.warnings.push_back(fmt::format("no tetrahedron is of {}{}", name, values));
  }
}

void add_layers(MaterialBricks& bricks, MeshAssembler& assembler) {
  for (std::size_t i = 0; i < bricks.layers().size(); ++i) {
    bricks.make(i, [&](std::int64_t, const BrickMesh& brick) { assembler.add(brick); });
    if (const MeshLayer& layer = bricks.layers()[i]; !layer.bricks.empty())
      assembler.end_layer(layer.bricks.front().high.z);
  }
}

}  // namespace

MadeMaterialMesh finished_mesh(const TagBricks& samples, const MaterialMeshJob& job, const Geometry& geometry,
                               const MaterialMeshOptions& options, const SpoolPlace& place,
                               MeshAssembler& assembler) {
  MadeMaterialMesh made{empty_mesh(geometry, job, place), {}, job.fine, job.coarse, {}};
  made.quality = assembler.finish(job.names, options.parts, made.mesh);
  if (options.counts_edges) count_touching_edges(made.mesh, made.quality, bytes_for_edges);
  made.warnings = job.warnings;
  warn_of_missing(job, samples, made, !options.labels || !options.labels->names.empty(),
                  options.labels.has_value());
  return made;
}

MadeMaterialMesh make_material_mesh(const TagBricks& samples, const MaterialMeshJob& job,
                                    const Geometry& geometry, const MaterialMeshOptions& options,
                                    const SpoolPlace& place, const Resources& resources,
                                    std::uint64_t besides, const Progress& progress) {
  const std::vector<MeshLayer> layers = layers_of(job);
  const MeshMemory memory = memory_for_mesh(samples.parameters(), job, layers, resources, besides);
  MeshAssembler assembler(job.settings, place, memory.parts);
  {
    MaterialBricks bricks(samples, job, layers, memory.threads, progress);
    add_layers(bricks, assembler);
  }
  return finished_mesh(samples, job, geometry, options, place, assembler);
}

}  // namespace tagrid
