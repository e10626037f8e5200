#include "pipeline/surface/surface.h"

#include <memory>

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/surface/surface_file.h"
#include "io/tag/bricks.h"
#include "pipeline/region/decode_region.h"
#include "pipeline/surface/surface_bricks.h"

namespace tagrid {
namespace {

// A surface from a file of which only the bricks of a region are read, or from all bricks as they come.
class Input {
 public:
  Input(const std::string& path, bool is_part) {
    if (is_part && is_regular_input(path))
      bricks_ = std::make_unique<TagBricks>(std::make_shared<FileSource>(path));
    else
      stream_ = std::make_unique<TagReader>(path);
  }

  const TagHeader& header() const { return bricks_ ? bricks_->header() : stream_->header(); }
  const std::string& name() const { return bricks_ ? bricks_->name() : stream_->name(); }
  const TagIndex& index() const { return bricks_ ? bricks_->index() : stream_->index(); }
  std::uint64_t bytes() const { return bricks_ ? bricks_->sizes().file : stream_->sizes().file; }

  // Throws MemoryLimit.
  void check_memory(const SurfacePart& part, const Resources& resources) const {
    const CodingParameters& parameters = header().parameters;
    if (bricks_)
      check_memory_of_box(parameters, part, resources);
    else
      plan_surface(parameters, resources);
  }

  SurfaceCounts pass_to(SurfaceSink& sink, const SurfacePart& part, const SurfaceLevel& level,
                        const SurfaceRun& run) {
    return bricks_ ? surface_of_box(*bricks_, part, level, run.resources, sink, run.progress)
                   : surface_of_all(*stream_, part, level, run.resources, sink, run.progress);
  }

 private:
  std::unique_ptr<TagBricks> bricks_;
  std::unique_ptr<TagReader> stream_;
};

}  // namespace

Finished<SurfaceResult> write_surface(const SurfaceRun& run) {
  const SurfaceOptions& options = run.options;
  const SurfaceFormat& format = surface_format_of(run.output);
  refuse_same_file(run.input, run.output);
  check_output(run.output, options.overwrite);
  Input input(run.input, !options.region.is_all());
  const CodingParameters& parameters = input.header().parameters;
  SurfacePart part{checked_level(options.level, parameters.cube_size), std::nullopt, options.close,
                   options.area};
  if (!options.region.is_all()) part.box = region_of(options.region, parameters).box;
  refuse_flat(parameters, input.name(), Problem::none);
  const SurfaceLevel level = surface_level(options.iso, input.header(), input.name());
  // Checked before anything is written.
  input.check_memory(part, run.resources);

  const std::shared_ptr<SurfaceFile> file = format.create(run.output, options.overwrite);
  const SurfaceCounts counts = input.pass_to(*file, part, level, run);
  file->finish();
  SurfaceResult result{input.header(), input.index(), input.bytes(), file->file_bytes(), counts, {}};
  if (!part.box && !counts.has_gaps) result.boundary_edges = counts.border_edges;
  return {std::move(result), file};
}

}  // namespace tagrid
