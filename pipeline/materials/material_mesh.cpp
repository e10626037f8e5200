#include "pipeline/materials/material_mesh.h"

#include <oneapi/tbb/parallel_pipeline.h>

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/files/output_file.h"
#include "io/meshes/formats.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "pipeline/materials/plan.h"
#include "pipeline/materials/sample_window.h"
#include "pipeline/materials/settings.h"
#include "pipeline/reading/read_region.h"
#include "pipeline/threads/threads.h"
#include "stages/materials/material_mesh.h"

namespace tagrid {
namespace {

BrickMesh mesh_of(const MaterialMeshJob& job, const SampleWindow& window, const Box& closed_box) {
  const Box box = samples_for(job, closed_box);
  if (job.label_smoothing) {
    const std::vector<Material> labels = window.values<Material>(box);
    return mesh_of_brick(LabelField({box, labels.data()}, job.places, *job.label_smoothing), job.settings,
                         closed_box);
  }
  const std::vector<float> values = window.values<float>(box);
  return mesh_of_brick(ValueField({box, values.data()}, job.places, job.thresholds), job.settings,
                       closed_box);
}

// Bricks are made by all threads, and put together in order.
void add_layer(const MaterialMeshJob& job, const SampleWindow& window, const MeshLayer& layer, int threads,
               MeshAssembler& assembler) {
  using oneapi::tbb::filter_mode;
  std::size_t next = 0;
  const auto number_of_brick = [&](oneapi::tbb::flow_control& control) -> std::size_t {
    if (next == layer.bricks.size()) control.stop();
    return next++;
  };
  const auto make = [&](std::size_t number) {
    return std::make_shared<const BrickMesh>(mesh_of(job, window, layer.bricks[number]));
  };
  const auto add = [&](const std::shared_ptr<const BrickMesh>& brick) { assembler.add(*brick); };
  oneapi::tbb::parallel_pipeline(
      static_cast<std::size_t>(bricks_in_flight(threads)),
      oneapi::tbb::make_filter<void, std::size_t>(filter_mode::serial_in_order, number_of_brick) &
          oneapi::tbb::make_filter<std::size_t, std::shared_ptr<const BrickMesh>>(filter_mode::parallel,
                                                                                  make) &
          oneapi::tbb::make_filter<std::shared_ptr<const BrickMesh>, void>(filter_mode::serial_in_order,
                                                                           add));
}

void add_layers(const TagBricks& samples, const MaterialMeshJob& job, const std::vector<MeshLayer>& layers,
                int thread_count, MeshAssembler& assembler, const Progress& progress) {
  SampleWindow window(samples, job.numbers, samples_of(layers), thread_count, progress);
  Threads threads(thread_count);
  for (const MeshLayer& layer : layers) {
    if (layer.bricks.empty()) continue;
    window.move_to(layer.samples.low.z, layer.samples.high.z);
    threads.run([&] { add_layer(job, window, layer, threads.count(), assembler); });
    assembler.end_layer(layer.bricks.front().high.z);
  }
}

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

}  // namespace

MadeMaterialMesh make_material_mesh(const TagBricks& samples, const Geometry& geometry,
                                    const MaterialMeshOptions& options, const std::string& path,
                                    const Resources& resources, std::uint64_t besides,
                                    const Progress& progress) {
  const MaterialMeshJob job = settle_material_mesh(samples, geometry, options);
  const std::vector<MeshLayer> layers = layers_of(job);
  const int thread_count = threads_for_mesh(samples.parameters(), job, layers, resources, besides);
  MeshAssembler assembler(job.settings, path);
  add_layers(samples, job, layers, thread_count, assembler, progress);
  MadeMaterialMesh made{empty_mesh(geometry, job, path), {}, job.fine, job.coarse, {}};
  made.quality = assembler.finish(job.names, options.parts, made.mesh);
  count_touching_edges(made.mesh, made.quality, bytes_for_edges);
  warn_of_missing(job, samples, made, !options.labels || !options.labels->names.empty(),
                  options.labels.has_value());
  return made;
}

Finished<MaterialMeshResult> write_material_mesh(const MaterialMeshRun& run) {
  const MaterialMeshOptions& options = run.options;
  const MeshFormat& format = material_mesh_format_of(run.output);
  for (const std::string& input : {run.input, options.label_volume})
    // What is missing is reported when it is opened.
    if (!input.empty() && !is_regular_input(input) && (input == "-" || without_links(input)))
      throw UsageError(fmt::format(
          "{}: a mesh with materials needs a file that is not read in one pass; write it to a file first",
          input));
  refuse_same_file(run.input, run.output);
  check_output(run.output, options.overwrite);
  const TagBricks file(volume_in(open_source(run.input), run.volume));
  std::optional<TagBricks> labels;
  if (!options.label_volume.empty()) {
    refuse_same_file(options.label_volume, run.output);
    labels.emplace(open_source(options.label_volume));
    const Index3 dims = file.parameters().dims, of_labels = labels->parameters().dims;
    if (!(dims == of_labels))
      throw UsageError(fmt::format("{}: has {} x {} x {} labels, but {} has {} x {} x {} samples",
                                   options.label_volume, of_labels.x, of_labels.y, of_labels.z, run.input,
                                   dims.x, dims.y, dims.z));
  }
  const std::shared_ptr<MaterialMeshFile> output = format.create_materials(run.output, options.overwrite);
  MadeMaterialMesh made =
      make_material_mesh(labels ? *labels : file, in_one_unit(file.header().metadata.geometry()), options,
                         run.output, run.resources, format.memory_of_writer, run.progress);
  output->write(made.mesh);
  MaterialMeshResult result{
      {file.header(), file.index(), file.sizes().file, output->file_bytes(), std::move(made.warnings)},
      std::move(made.quality),
      made.fine,
      made.coarse,
      made.mesh.unit,
      made.mesh.point_count(),
      made.mesh.element_count(),
      made.mesh.surfaces};
  for (const std::string& warning : output->warnings()) result.warnings.push_back(warning);
  return {std::move(result), output};
}

}  // namespace tagrid
