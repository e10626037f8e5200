#include "tools/preview/captions.h"

#include <fmt/format.h>

#include <cmath>

#include "io/metadata/lengths.h"
#include "io/metadata/region.h"
#include "io/text/text.h"
#include "io/volume/one_of_volumes.h"
#include "tools/report/human_bytes.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

std::string spacing_words(const Lengths& lengths) {
  const Geometry& g = lengths.geometry;
  if (!g.has_spacing) return "spacing unknown";
  const std::string unit = lengths.unit(0);
  const bool one_unit = !has_unknown_spacing(g) && lengths.unit(1) == unit && lengths.unit(2) == unit;
  std::string text = "spacing";
  for (int axis = 0; axis < 3; ++axis) {
    text += (axis > 0 ? " x " : " ") + short_number(lengths.spacing(axis));
    if (!one_unit && !lengths.unit(axis).empty()) text += " " + lengths.unit(axis);
  }
  return one_unit ? text + (unit.empty() ? " (no unit given)" : " " + unit) : text;
}

std::string error_words(const TagHeader& header, const Statistics& total) {
  const CodingParameters& p = header.parameters;
  const bool has_slopes = header.metadata.has_slopes_of_slices();
  const Rescale rescale = header.metadata.rescale();
  const std::string unit = rescale.units.empty() ? "" : " " + printable(rescale.units);
  // In values, as the gray scale is; with slopes of slices, both are of samples.
  const auto shown = [&](double error) {
    return short_number(error * std::abs(rescale.slope)) + (has_slopes ? " in stored samples" : unit);
  };
  const std::string of_mesh = p.mesh_error >= 0 ? ", mesh within " + shown(p.mesh_error) : "";
  if (p.mode == FileMode::voxels && p.is_exact()) return "lossless" + of_mesh;
  std::string text = p.mode == FileMode::grid ? "grid only, " : "";
  text += p.max_error < 0 ? "no bound" : "every voxel within " + shown(p.max_error);
  if (p.surface_error >= 0) text += ", active points within " + shown(p.surface_error);
  text += of_mesh;
  text += ", largest error " + (has_slopes ? error_text(total.max_error, header) : shown(total.max_error));
  const Achieved achieved = achieved_of(total);
  if (!std::isnan(achieved.psnr)) text += fmt::format(", PSNR {:.2f} dB", achieved.psnr);
  return text;
}

}  // namespace

std::string short_number(double value) { return fmt::format("{:.6g}", value); }

std::string Lengths::unit(int axis) const {
  const auto a = static_cast<std::size_t>(axis);
  if (!(std::abs(geometry.spacing[a]) > 0)) return "samples";
  const auto& units = geometry.units;
  // Units of coordinates are not units of axes, unless they are all the same.
  if (geometry.has_directions && !(units[0] == units[1] && units[1] == units[2])) return "";
  return printable(units[a]);
}

double Lengths::spacing(int axis) const {
  const double distance = std::abs(geometry.spacing[static_cast<std::size_t>(axis)]);
  return distance > 0 ? distance : 1;
}

double Lengths::distance(int axis, std::int64_t slice) const {
  if (axis == 2 && !of_slices.empty()) return of_slices[static_cast<std::size_t>(slice)];
  return static_cast<double>(slice) * spacing(axis);
}

Lengths lengths_of(const TagHeader& header) {
  const Geometry given = header.metadata.geometry();
  const Index3& dims = header.parameters.dims;
  Lengths lengths{in_one_unit(given), dims, slice_distances(header.metadata, dims.z)};
  const double in_unit = lengths.geometry.spacing[2] / given.spacing[2];
  for (double& distance : lengths.of_slices) distance *= std::isnan(in_unit) ? 1 : in_unit;
  return lengths;
}

std::vector<std::string> lines_about(const TagBricks& file, std::int64_t number, const TagBricks& volume) {
  const TagHeader& header = volume.header();
  const CodingParameters& p = header.parameters;
  const int volumes = file.header().volumes;
  const auto voxels = static_cast<std::uint64_t>(Box::of_size(file.header().all_dims()).count()),
             raw = voxels * size_of(p.type), bytes = file.sizes().file;
  std::string first, name = printable(header.metadata.text_of(volume_name_key));
  if (volumes > 1)
    first = fmt::format("volume {} of 0..{}{}: ", number, volumes - 1, name.empty() ? "" : " (" + name + ")");
  first += fmt::format("{} x {} x {} {}, {}", p.dims.x, p.dims.y, p.dims.z, name_of(p.type),
                       spacing_words({header.metadata.geometry(), p.dims}));
  if (has_uneven_slices(header)) first += ", slices at unequal distances";
  const std::string errors = error_words(header, volume.index().total),
                    sizes =
                        fmt::format("{}{} in {}, ratio {:.2f}, {:.3f} bits per voxel",
                                    volumes > 1 ? "all volumes " : "", human_bytes(raw), human_bytes(bytes),
                                    static_cast<double>(raw) / static_cast<double>(bytes),
                                    8 * static_cast<double>(bytes) / static_cast<double>(voxels));
  // Errors in both units fill their line.
  if (header.metadata.has_slopes_of_slices()) return {first + "; " + sizes, errors};
  return {first, errors + "; " + sizes};
}

std::string length_words(double length, const std::string& unit) {
  return fmt::format("{:.4g} {}", length, unit.empty() ? "units" : unit);
}

std::string slice_caption(const Panel& panel, const Lengths& lengths) {
  std::string text =
      fmt::format("{} = {} of 0..{}", "xyz"[panel.axis], panel.slice, lengths.dims[panel.axis] - 1);
  const std::string unit = lengths.unit(panel.axis);
  if (unit != "samples") text += ", " + length_words(lengths.distance(panel.axis, panel.slice), unit);
  if (panel.block() > 1) text += fmt::format(", means of {0} x {0} x {0}", panel.block());
  if (!panel.to_scale) text += ", not to scale";
  return text;
}

std::string direction_caption(const Panel& panel) {
  return fmt::format("{} to the right, {} {}", "xyz"[panel.across.axis], "xyz"[panel.down.axis],
                     panel.down.reversed ? "up" : "down");
}

}  // namespace tagrid
