#include "pipeline/materials/material_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/files/output_file.h"
#include "io/meshes/formats.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "pipeline/materials/brick_spool.h"
#include "pipeline/materials/plan.h"
#include "pipeline/materials/settings.h"

namespace tagrid {
namespace {

// Puts together the bricks that ranks have made.
void add_layers(const std::vector<MeshLayer>& layers, BrickSpool& made, MeshAssembler& assembler) {
  std::int64_t number = 0;
  for (const MeshLayer& layer : layers) {
    for (std::size_t i = 0; i < layer.bricks.size(); ++i) assembler.add(made.read(number++));
    if (!layer.bricks.empty()) assembler.end_layer(layer.bricks.front().high.z);
  }
}

// True if the samples of two volumes of the same size are at other places, as far as both say where they are.
bool lies_elsewhere(const TagBricks& a, const TagBricks& b) {
  const Geometry of_a = in_one_unit(a.header().metadata.geometry()),
                 of_b = in_one_unit(b.header().metadata.geometry());
  if (!of_a.has_spacing || !of_b.has_spacing) return false;
  const double tenth = std::abs(spacing_or_1(of_a, 0)) / 10;
  const auto distance = [](const std::array<double, 3>& u, const std::array<double, 3>& v) {
    return std::hypot(u[0] - v[0], u[1] - v[1], u[2] - v[2]);
  };
  if (of_a.has_origin && of_b.has_origin && distance(of_a.origin, of_b.origin) > tenth) return true;
  const auto across = [&](const Geometry& geometry) {
    auto w = to_world(geometry, a.parameters().dims - Index3{1, 1, 1});
    for (std::size_t i = 0; i < 3; ++i) w[i] -= geometry.origin[i];
    return w;
  };
  return of_a.has_directions == of_b.has_directions && distance(across(of_a), across(of_b)) > tenth;
}

}  // namespace

MaterialMeshInputs::MaterialMeshInputs(const std::string& input, std::int64_t volume,
                                       const std::string& label_volume)
    : file(volume_in(open_source(input), volume)) {
  if (label_volume.empty()) return;
  labels.emplace(open_source(label_volume));
  const Index3 dims = file.parameters().dims, of_labels = labels->parameters().dims;
  if (!(dims == of_labels))
    throw UsageError("{}: has {} x {} x {} labels, but {} has {} x {} x {} samples", label_volume,
                     of_labels.x, of_labels.y, of_labels.z, input, dims.x, dims.y, dims.z);
  if (lies_elsewhere(file, *labels))
    warnings.push_back(fmt::format(
        "the labels in {} lie elsewhere than the samples of {}; the mesh is where the samples are",
        label_volume, input));
}

Geometry MaterialMeshInputs::geometry() const { return in_one_unit(file.header().metadata.geometry()); }

Finished<MaterialMeshResult> write_material_mesh(const MaterialMeshRun& run, const MakeBricks& share) {
  const MaterialMeshOptions& options = run.options;
  const MeshFormat& format = material_mesh_format_of(run.output);
  for (const std::string& input : {run.input, options.label_volume}) {
    if (input.empty()) continue;
    // What is missing is reported when it is opened.
    if (!is_regular_input(input) && (input == "-" || without_links(input)))
      throw UsageError(
          "{}: a mesh with materials needs a file that is not read in one pass; write it to a file first",
          input);
    refuse_same_file(input, run.output);
    if (format.second_file != nullptr) refuse_same_file(input, format.second_file(run.output));
  }
  check_output(run.output, options.overwrite);
  const MaterialMeshInputs inputs(run.input, run.volume, options.label_volume);
  const Geometry geometry = inputs.geometry();
  const MaterialMeshJob job = settle_material_mesh(inputs.samples(), geometry, options);
  const std::shared_ptr<MaterialMeshFile> output = format.create_materials(run.output, options.overwrite);
  const SpoolPlace place{spool_folder({}, run.output), run.output};
  std::optional<MadeMaterialMesh> made;
  if (share) {
    BrickSpool bricks(place.file());
    share(bricks);
    const std::vector<MeshLayer> layers = layers_of(job);
    MeshAssembler assembler(
        job.settings, place,
        memory_for_mesh(inputs.samples().parameters(), job, layers, run.resources, format.memory_of_writer)
            .parts);
    add_layers(layers, bricks, assembler);
    made.emplace(finished_mesh(inputs.samples(), job, geometry, options, place, assembler));
  } else {
    made.emplace(make_material_mesh(inputs.samples(), job, geometry, options, place, run.resources,
                                    format.memory_of_writer, run.progress));
  }
  output->write(made->mesh);
  made->warnings.insert(made->warnings.begin(), inputs.warnings.begin(), inputs.warnings.end());
  const TagBricks& file = inputs.file;
  MaterialMeshResult result{
      {file.header(), file.index(), file.sizes().file, output->file_bytes(), std::move(made->warnings)},
      std::move(made->quality),
      made->fine,
      made->coarse,
      made->mesh.unit,
      made->mesh.point_count(),
      made->mesh.element_count(),
      made->mesh.surfaces};
  for (const std::string& warning : output->warnings()) result.warnings.push_back(warning);
  return {std::move(result), output};
}

}  // namespace tagrid
