#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/errors/errors.h"
#include "io/metadata/foreign_geometry.h"
#include "io/text/text.h"
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

// Why there is no tetrahedron of a material; "" if there is one.
std::string why_missing(Material material, const MaterialMeshJob& job, const MaterialMeshOptions& options,
                        const TagBricks& samples, const MeshQuality& quality) {
  const std::string& name = job.names.names.at(material);
  for (const MeshQuality::OfMaterial& m : quality.materials) {
    if (m.name != name) continue;
    return m.tetrahedra > 0 ? "" : fmt::format("no part of {} is large enough", name);
  }
  const auto& total = samples.index().total;
  const Rescale rescale = options.labels ? Rescale{} : samples.header().metadata.rescale();
  const auto [low, high] = std::minmax(
      {rescale.slope * total.low + rescale.intercept, rescale.slope * total.high + rescale.intercept});
  const auto range = std::find_if(options.ranges.begin(), options.ranges.end(),
                                  [&](const MaterialRange& r) { return r.name == name; });
  const bool may_be_there =
      options.labels ? low <= material && material <= high : range->low <= high && range->high > low;
  if (may_be_there)
    return fmt::format(
        "no tetrahedron is of {}: no sample is of it, or it is thinner than the cubes, whose edge is "
        "{:.6g}{}",
        name, job.fine, job.unit.empty() ? "" : " " + job.unit);
  return fmt::format("no tetrahedron is of {}; {} are from {:.6g} to {:.6g}", name,
                     options.labels ? "labels" : "values", low, high);
}

// A mesh of a region may be empty.
void report_missing(const MaterialMeshJob& job, const MaterialMeshOptions& options, const TagBricks& samples,
                    MadeMaterialMesh& made) {
  const bool may_be_empty = job.settings.region.has_value();
  const bool is_empty = made.mesh.element_count() == 0;
  // Without names, all labels are wanted that there are.
  if (options.labels && options.labels->names.empty() && options.keep.empty()) {
    if (is_empty && !may_be_empty)
      throw UsageError(
          "{}: no tetrahedron is of a label that is not 0; its parts are thinner than the cubes, whose edge "
          "is {:.6g}, or too small",
          samples.name(), job.fine);
    return;
  }
  std::vector<std::string> reasons;
  for (const auto& [material, name] : job.names.names) {
    if (!job.settings.keeps(material)) continue;
    if (std::string reason = why_missing(material, job, options, samples, made.quality); !reason.empty())
      reasons.push_back(std::move(reason));
  }
  if (is_empty && !may_be_empty)
    throw UsageError("{}: the mesh would be empty: {}", samples.name(), fmt::join(reasons, "; "));
  made.warnings.insert(made.warnings.end(), reasons.begin(), reasons.end());
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
  report_missing(job, options, samples, made);
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
