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
#include "pipeline/materials/bricks.h"
#include "pipeline/materials/plan.h"
#include "pipeline/materials/settings.h"

namespace tagrid {
namespace {

MaterialMesh empty_mesh(const Geometry& geometry, const MaterialMeshJob& job, const std::string& path) {
  return {job.settings.order,
          {short_name_of_space(geometry.space), {}, job.fine},
          job.unit,
          {},
          {},
          SpoolFile::beside(path),
          SpoolFile::beside(path),
          SpoolFile::beside(path),
          SpoolFile::beside(path)};
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
  for (const auto& [material, name] : job.names.names) {
    if (!job.settings.keeps(material)) continue;
    const auto is_it = [&](const MaterialElements& m) { return m.name == name && m.count > 0; };
    if (std::none_of(result.mesh.materials.begin(), result.mesh.materials.end(), is_it))
      result.warnings.push_back(fmt::format("no tetrahedron is of {}{}", name, values));
  }
}

// Puts bricks together, however they were made.
MadeMaterialMesh finished(const TagBricks& samples, const MaterialMeshJob& job, const Geometry& geometry,
                          const MaterialMeshOptions& options, const std::string& path,
                          MeshAssembler& assembler) {
  MadeMaterialMesh made{empty_mesh(geometry, job, path), {}, job.fine, job.coarse, {}};
  made.quality = assembler.finish(job.names, options.parts, made.mesh);
  if (options.counts_edges) count_touching_edges(made.mesh, made.quality, bytes_for_edges);
  made.warnings = job.warnings;
  warn_of_missing(job, samples, made, !options.labels || !options.labels->names.empty(),
                  options.labels.has_value());
  return made;
}

void add_layers(MaterialBricks& bricks, int thread_count, MeshAssembler& assembler) {
  for (std::size_t i = 0; i < bricks.layers().size(); ++i) {
    bricks.make(i, thread_count, [&](std::int64_t, const BrickMesh& brick) { assembler.add(brick); });
    if (const MeshLayer& layer = bricks.layers()[i]; !layer.bricks.empty())
      assembler.end_layer(layer.bricks.front().high.z);
  }
}

// The same of bricks that ranks have made.
void add_layers(const std::vector<MeshLayer>& layers, BrickSpool& made, MeshAssembler& assembler) {
  std::int64_t number = 0;
  for (const MeshLayer& layer : layers) {
    for (std::size_t i = 0; i < layer.bricks.size(); ++i) assembler.add(made.read(number++));
    if (!layer.bricks.empty()) assembler.end_layer(layer.bricks.front().high.z);
  }
}

}  // namespace

namespace {

// True if the first or the last sample of two volumes of the same size are more than a tenth of a sample apart, as far as
// both say where they are.
bool lies_elsewhere(const TagBricks& a, const TagBricks& b) {
  const Geometry of_a = in_one_unit(a.header().metadata.geometry()),
                 of_b = in_one_unit(b.header().metadata.geometry());
  if (!of_a.has_spacing || !of_b.has_spacing) return false;
  const Index3 last = a.parameters().dims - Index3{1, 1, 1};
  const double tenth = spacing_or_1(of_a, 0) / 10;
  const auto differ = [&](Index3 p) {
    const auto u = to_world(of_a, p), v = to_world(of_b, p);
    return std::hypot(u[0] - v[0], u[1] - v[1], u[2] - v[2]) > std::abs(tenth);
  };
  return differ({0, 0, 0}) || differ(last);
}

}  // namespace

MadeMaterialMesh make_material_mesh(const TagBricks& samples, const Geometry& geometry,
                                    const MaterialMeshOptions& options, const std::string& path,
                                    const Resources& resources, std::uint64_t besides,
                                    const Progress& progress) {
  const MaterialMeshJob job = settle_material_mesh(samples, geometry, options);
  const std::vector<MeshLayer> layers = layers_of(job);
  const int threads = threads_for_mesh(samples.parameters(), job, layers, resources, besides);
  MeshAssembler assembler(job.settings, path);
  {
    MaterialBricks bricks(samples, job, layers, threads, progress);
    add_layers(bricks, threads, assembler);
  }
  return finished(samples, job, geometry, options, path, assembler);
}

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
  const std::shared_ptr<MaterialMeshFile> output = format.create_materials(run.output, options.overwrite);
  std::optional<MadeMaterialMesh> made;
  if (share) {
    const MaterialMeshJob job = settle_material_mesh(inputs.samples(), geometry, options);
    BrickSpool bricks(run.output);
    share(inputs, job, bricks);
    MeshAssembler assembler(job.settings, run.output);
    add_layers(layers_of(job), bricks, assembler);
    made.emplace(finished(inputs.samples(), job, geometry, options, run.output, assembler));
  } else {
    made.emplace(make_material_mesh(inputs.samples(), geometry, options, run.output, run.resources,
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
