#include "pipeline/surface/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <variant>

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/text.h"
#include "io/nrrd/geometry.h"
#include "io/nrrd/rescale.h"
#include "io/surface/surface_file.h"
#include "io/tag/bricks.h"
#include "pipeline/region/decode_region.h"

namespace tagrid {
namespace {

SurfaceLevel level_in_samples(double iso, const TagHeader& header, const std::string& name) {
  const KeyValues pairs = key_values_of(header.nrrd_fields);
  const auto of_each_slice = [](const auto& pair) { return pair.first == "slice_slopes"; };
  if (std::ranges::any_of(pairs, of_each_slice))
    throw UsageError(fmt::format(
        "{}: each slice has a slope of its own (slice_slopes), so that a value is a different sample in each",
        name));
  for (const auto& [key, value] : pairs)
    if (key == "rescale_slope" && number_of(value).value_or(0) == 0)
      throw BrokenInput(fmt::format("{}: the header: a rescale_slope of {} is no slope", name,
                                    quoted(std::string_view(value))));
  const Rescale rescale = rescale_of(header.nrrd_fields);
  const SurfaceLevel level{(iso - rescale.intercept) / rescale.slope, rescale.slope < 0};
  if (!std::isfinite(level.value))
    throw UsageError(fmt::format("{}: a value of {} is no finite sample with the slope {} of this file", name,
                                 iso, rescale.slope));
  return level;
}

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

  Box positions(const SurfacePart& part) const {
    const BrickGrid bricks = header().parameters.bricks();
    return bricks_ && part.box ? bricks_that_meet(*part.box, bricks)
                               : Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)});
  }

  // Throws MemoryLimit.
  void check_memory(const Box& positions, const Resources& resources) const {
    const CodingParameters& parameters = header().parameters;
    const std::uint64_t builder = SurfaceBuilder::working_bytes(parameters, positions);
    if (bricks_)
      threads_for_taking(parameters, positions, builder, resources);
    else
      plan_taking(parameters, builder, resources);
  }

  void pass_to(SurfaceBuilder& builder, const Box& positions, const SurfaceRun& run) {
    const std::uint64_t bytes = SurfaceBuilder::working_bytes(header().parameters, positions);
    if (bricks_)
      take_some(*bricks_, positions, bytes, run.resources, builder, run.progress);
    else
      take_all(*stream_, bytes, run.resources, builder, run.progress);
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
  const SurfaceLevel level = level_in_samples(options.iso, input.header(), input.name());
  const Box positions = input.positions(part);
  // Checked before anything is written.
  input.check_memory(positions, run.resources);

  const std::shared_ptr<SurfaceFile> file = format.create(run.output, options.overwrite);
  SurfaceBuilder builder(input.header(), positions, part, level, *file);
  input.pass_to(builder, positions, run);
  file->finish();
  const SurfaceCounts& counts = builder.counts();
  SurfaceResult result{input.header(), input.index(), input.bytes(), file->file_bytes(), counts, {}};
  if (!part.box && !counts.has_gaps) result.boundary_edges = counts.border_edges;
  return {std::move(result), file};
}

}  // namespace tagrid
