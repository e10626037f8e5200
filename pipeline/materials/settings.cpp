#include "pipeline/materials/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/errors/errors.h"
#include "io/metadata/lengths.h"
#include "io/text/text.h"
#include "pipeline/materials/sample_window.h"
#include "pipeline/reading/read_region.h"

namespace tagrid {
namespace {

constexpr int smallest_cube = 4, largest_cube = 128;  // edges of root cubes, in points of the lattice
constexpr Material no_label = 0;
constexpr double most_root_cubes = 1 << 26;

// As callers of the library and the command line call them.
constexpr Setting setting_size = {"size", "the size of cubes"},
                  setting_materials = {"materials", "the materials"},
                  setting_keep = {"keep", "the materials to keep"}, setting_labels = {"labels", "the labels"},
                  setting_smooth = {"smooth", "the smoothing of labels"},
                  setting_order = {"order", "the order of elements"};
// Between samples, cubes follow interpolation only.
constexpr int finest_part = 16;

double in_units_of(const MeshLength& wanted, const CommonUnit& unit, const char* what) {
  if (!(wanted.length > 0) || !std::isfinite(wanted.length))
    throw UsageError("{}: {} must be greater than 0", setting_size, what);
  if (wanted.unit.empty()) return wanted.length;
  const auto from = length_unit(wanted.unit);
  if (!from)
    throw UsageError("{}: '{}' is not a unit of length, such as mm or um", setting_size, wanted.unit);
  const auto to = length_unit(unit.name);
  if (!unit.is_known || !to)
    throw UsageError(
        "{}: the file does not state its unit of length; give sizes without '{}', in the units "
        "of its spacing",
        setting_size, wanted.unit);
  return converted(wanted.length, *from, *to);
}

void settle_lattice(const TagBricks& file, const Geometry& geometry, const MaterialMeshOptions& options,
                    MaterialMeshJob& job) {
  const CommonUnit unit = common_unit(geometry);
  job.unit = unit.name;
  const Index3 dims = file.parameters().dims;
  std::array<std::array<double, 3>, 3> steps{};  // from sample to sample
  std::array<double, 3> spacing{};
  job.settings.origin = to_world(geometry, Index3{0, 0, 0});
  for (int axis = 0; axis < 3; ++axis) {
    const std::array<double, 3> next = to_world(geometry, unit_vector(axis));
    const auto a = static_cast<std::size_t>(axis);
    for (std::size_t i = 0; i < 3; ++i) steps[a][i] = next[i] - job.settings.origin[i];
    spacing[a] = std::hypot(steps[a][0], steps[a][1], steps[a][2]);
    if (!(spacing[a] > 0) || !std::isfinite(spacing[a]))
      throw UsageError("{}: the distance of samples along {} is not a number above 0", file.name(),
                       "xyz"[axis]);
  }
  const double smallest = *std::min_element(spacing.begin(), spacing.end());
  job.fine = options.fine ? in_units_of(*options.fine, unit, "the finest edge") : 2 * smallest;
  if (job.fine * finest_part < smallest * (1 - 1e-12))
    throw UsageError(
        "{}: {:.6g} is too fine: samples are {:.6g} {}apart, and cubes must have at least "
        "1/{} of that",
        setting_size, job.fine, smallest, job.unit.empty() ? "" : job.unit + " ", finest_part);
  job.coarse = options.coarse ? in_units_of(*options.coarse, unit, "the coarsest edge") : 8 * job.fine;
  if (job.coarse < job.fine)
    throw UsageError("{}: the coarsest edge must not be less than the finest one", setting_size);
  int cube = smallest_cube;
  while (cube < largest_cube && cube * job.fine * (1 - 1e-12) <= job.coarse) cube *= 2;
  job.settings.lattice.cube_size = cube;
  job.coarse = cube / 2 * job.fine;
  job.places.dims = dims;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (dims[axis] == 1)
      throw UsageError("{}: has one sample along {}; a mesh needs a volume", file.name(), "xyz"[axis]);
    const double cubes =
        std::floor(static_cast<double>(dims[axis] - 1) * spacing[a] / job.fine * (1 + 1e-12));
    if (!(cubes >= 1))
      throw UsageError(
          "{}: the volume is {:.6g} {}thick along {}, less than the edge of the finest cubes, "
          "{:.6g}; choose a "
          "smaller size",
          file.name(), static_cast<double>(dims[axis] - 1) * spacing[a],
          job.unit.empty() ? "" : job.unit + " ", "xyz"[axis], job.fine);
    if (cubes > 1 << 20)
      throw UsageError("{}: {:.6g} is too fine: {:.6g} cubes along {}", setting_size, job.fine, cubes,
                       "xyz"[axis]);
    job.settings.lattice.last[axis] = 2 * static_cast<std::int64_t>(cubes);
    job.places.step[a] = job.fine / 2 / spacing[a];
    for (std::size_t i = 0; i < 3; ++i)
      job.settings.directions[a][i] = steps[a][i] * job.places.step[a] / static_cast<double>(parts_per_point);
  }
  const BrickGrid bricks{job.settings.lattice.domain(), 1};
  if (static_cast<double>(bricks.bricks(0)) * static_cast<double>(bricks.bricks(1)) *
          static_cast<double>(bricks.bricks(2)) >
      most_root_cubes)
    throw UsageError("{}: {:.6g} is too fine for a volume of this size", setting_size, job.fine);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto &u = steps[a], &v = steps[(a + 1) % 3];
    const double cosine = (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) / spacing[a] / spacing[(a + 1) % 3];
    if (std::abs(cosine) > 1e-3) {
      job.warnings.push_back(
          "the axes of the volume are not perpendicular, so angles are smaller than they would be");
      break;
    }
  }
  const double volume = determinant(steps);
  if (!(std::abs(volume) > 0)) throw UsageError(file.name() + ": the directions of its axes span no volume");
  job.settings.is_mirrored = volume < 0;
}

// Names must be those of sets in every format.
void check_name(const std::string& name, const Setting& setting) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const bool is_valid =
      !name.empty() && is_letter(name[0]) && std::all_of(name.begin(), name.end(), [&](char c) {
        return is_letter(c) || (c >= '0' && c <= '9') || c == '_';
      });
  // Two of them are the name of an interface, which has up to 80 characters in a deck for Abaqus.
  constexpr std::size_t longest = 38;
  if (!is_valid || name.size() > longest)
    throw UsageError(
        "{}: '{}' is not a name of at most {} letters, digits and underscores that begins "
        "with a letter",
        setting, name, longest);
}

void keep_named(const MaterialMeshOptions& options, MaterialMeshJob& job) {
  std::set<std::string> wanted;
  for (const std::string& name : options.keep) wanted.insert(lower_case(name));
  std::string known;
  for (const auto& [material, name] : job.names.names) {
    known += (known.empty() ? "" : ", ") + name;
    if (!options.keep.empty() && wanted.erase(lower_case(name)) == 0) continue;
    if (material >= job.settings.is_kept.size()) job.settings.is_kept.resize(material + std::size_t{1});
    job.settings.is_kept[material] = true;
  }
  if (!wanted.empty())
    throw UsageError("{}: no material is called '{}'; there are {}", setting_keep, *wanted.begin(), known);
}

void settle_values(const TagBricks& file, const MaterialMeshOptions& options, MaterialMeshJob& job) {
  job.numbers = numbers_of_values(file.header(), &file.index());
  std::vector<MaterialRange> ranges = options.ranges;
  for (const MaterialRange& range : ranges) {
    check_name(range.name, setting_materials);
    if (!(range.low < range.high))
      throw UsageError("{}: {} has no values from {} to {}", setting_materials, range.name, range.low,
                       range.high);
  }
  std::sort(ranges.begin(), ranges.end(),
            [](const MaterialRange& a, const MaterialRange& b) { return a.low < b.low; });
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::vector<std::string> names;  // by material; "": values of no material that was named
  double before = 0;
  const auto begin_at = [&](double value, const std::string& name) {
    if (job.thresholds.empty()) job.reference = value;
    constexpr double most = SampleWindow::largest_value;
    const auto threshold = static_cast<float>(std::clamp(value - job.reference, -most, most));
    if (!job.thresholds.empty() && !(threshold > job.thresholds.back()))
      throw UsageError("{}: {} and {} are too close for the precision of float32", setting_materials, before,
                       value);
    before = value;
    job.thresholds.push_back(threshold);
    names.push_back(name);
  };
  double end = -infinity;
  if (ranges.front().low > -infinity) names.emplace_back();
  for (const MaterialRange& range : ranges) {
    if (range.low < end)
      throw UsageError("{}: {} begins at {}, but another one ends at {}", setting_materials, range.name,
                       range.low, end);
    if (end > -infinity && range.low > end) begin_at(end, "");
    if (range.low == -infinity)
      names.push_back(range.name);
    else
      begin_at(range.low, range.name);
    end = range.high;
  }
  if (end < infinity) begin_at(end, "");
  if (job.thresholds.empty())
    throw UsageError("{}: all values are of one material; give the value at which another one begins",
                     setting_materials);
  if (names.size() > std::size_t{std::numeric_limits<Material>::max()} + 1)
    throw UsageError("{}: there are {}, but at most {} are possible", setting_materials, names.size(),
                     std::numeric_limits<Material>::max());
  for (std::size_t m = 0; m < names.size(); ++m)
    if (!names[m].empty()) job.names.names.emplace(static_cast<Material>(m), names[m]);
  keep_named(options, job);
  std::set<std::string> taken;
  for (const std::string& name : names) taken.insert(lower_case(name));
  for (std::size_t m = 0; m < names.size(); ++m) {
    if (!names[m].empty()) continue;
    std::string name = "other";
    for (int n = 2; !taken.insert(name).second; ++n) name = fmt::format("other_{}", n);
    job.names.names.emplace(static_cast<Material>(m), name);
  }
  job.names.first_label = 1;
}

void settle_labels(const TagBricks& file, const MaterialMeshOptions& options, MaterialMeshJob& job) {
  const LabelsWish& labels = *options.labels;
  constexpr auto largest = std::numeric_limits<Material>::max();
  const SampleType type = file.parameters().type;
  if (is_float_type(type))
    throw UsageError("{}: labels must be integers, but its samples are {}; encode them as uint8 or uint16",
                     file.name(), name_of(type));
  const auto& total = file.index().total;
  if (total.low < 0 || total.high > largest)
    throw UsageError("{}: labels must be from 0 to {}, but its samples are from {} to {}", file.name(),
                     largest, total.low, total.high);
  if (!file.parameters().is_exact())
    throw UsageError(
        "{}: its samples may be wrong by {}, so they cannot be labels; encode it without "
        "a loss",
        file.name(), file.parameters().max_error);
  if (labels.smoothing != 0 &&
      !(labels.smoothing >= LabelField::smallest_radius && labels.smoothing <= LabelField::largest_radius))
    throw UsageError("{}: {} is neither 0 nor from {} to {}", setting_smooth, labels.smoothing,
                     LabelField::smallest_radius, LabelField::largest_radius);
  job.label_smoothing = labels.smoothing;
  for (const auto& [label, name] : labels.names) {
    if (label < 0 || label > largest)
      throw UsageError("{}: {} is not from 0 to {}", setting_labels, label, largest);
    if (const std::string lower = lower_case(name);
        lower.starts_with("label_") && lower != fmt::format("label_{}", label))
      throw UsageError("{}: '{}' is the name of another label", setting_labels, name);
    job.names.names.emplace(static_cast<Material>(label), name);
  }
  if (!labels.names.empty()) {
    keep_named(options, job);
  } else {
    for (auto label = static_cast<std::int64_t>(total.low); label <= static_cast<std::int64_t>(total.high);
         ++label)
      if (label != no_label)
        job.names.names.emplace(static_cast<Material>(label),
                                job.names.name_of(static_cast<Material>(label)));
    keep_named(options, job);
    constexpr std::size_t many = 255;
    if (job.names.names.size() > many)
      job.warnings.push_back(fmt::format(
          "there may be {} labels; if the samples are values of a scan, mesh ranges of values instead",
          job.names.names.size()));
  }
}

}  // namespace

MaterialMeshJob settle_materials(const TagBricks& file, const MaterialMeshOptions& options) {
  MaterialMeshJob job;
  if (options.labels)
    settle_labels(file, options, job);
  else
    settle_values(file, options, job);
  const Setting& setting = options.labels ? setting_labels : setting_materials;
  std::set<std::string> seen;
  for (const auto& [material, name] : job.names.names) {
    // Lists of names have labels that are not in the file.
    if (const auto& total = file.index().total;
        options.labels && (material < total.low || material > total.high))
      continue;
    check_name(name, setting);
    if (!seen.insert(lower_case(name)).second)
      throw UsageError("{}: two are called '{}', if case is ignored", setting, name);
  }
  return job;
}

MaterialMeshJob settle_material_mesh(const TagBricks& file, const Geometry& geometry,
                                     const MaterialMeshOptions& options) {
  if (options.order != 1 && options.order != 2) throw UsageError("{}: must be 1 or 2", setting_order);
  MaterialMeshJob job = settle_materials(file, options);
  job.settings.order = options.order;
  if (options.prefers_angles) job.settings.rule = best_angles;
  settle_lattice(file, in_one_unit(geometry), options, job);
  if (!options.region.is_all()) {
    const Domain& domain = file.parameters().domain();
    const Box samples = domain.samples_at(region_of(options.region, file.parameters()).box);
    Box& region = job.settings.region.emplace();
    for (int axis = 0; axis < 3; ++axis) {
      const double parts =
          static_cast<double>(parts_per_point) / job.places.step[static_cast<std::size_t>(axis)];
      region.low[axis] =
          static_cast<std::int64_t>(std::floor(static_cast<double>(samples.low[axis]) * parts));
      region.high[axis] =
          static_cast<std::int64_t>(std::ceil(static_cast<double>(samples.high[axis]) * parts));
    }
  }
  return job;
}

}  // namespace tagrid
