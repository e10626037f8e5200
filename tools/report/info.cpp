#include "tools/report/info.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "io/envelope/envelope.h"
#include "io/metadata/entries.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"
#include "io/metadata/region.h"
#include "io/metadata/rescale.h"
#include "io/text/text.h"
#include "stages/grid/lattice.h"
#include "tools/report/human_bytes.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

using nlohmann::ordered_json;

struct LevelRow {
  int level;
  std::uint64_t points, active;
};

std::vector<LevelRow> level_rows(const TagHeader& header, const TagIndex& index) {
  const std::vector<std::uint64_t> points = points_up_to_level(header.parameters.domain());
  std::vector<LevelRow> rows;
  std::uint64_t active = 0;
  for (std::size_t level = 0; level < points.size(); ++level)
    rows.push_back({static_cast<int>(level), points[level], active += index.total.active[level]});
  return rows;
}

ordered_json number_or_null(double value, bool present) {
  if (!present) return nullptr;
  // Whole numbers are shown without a fraction.
  if (value == std::floor(value) && std::abs(value) < 9e15) return static_cast<std::int64_t>(value);
  return value;
}

/// A negative bound is none.
ordered_json bound_or_null(double bound) { return number_or_null(bound, bound >= 0); }

std::string bound_text(double bound) { return bound < 0 ? "none" : fmt::format("{}", bound); }

/// The positions of slices at unequal distances: "x y z; x y z"; null if there are none.
ordered_json slice_positions(const TagHeader& header) {
  const std::string list = header.metadata.text_of(slice_positions_key);
  if (list.empty()) return nullptr;
  ordered_json positions = ordered_json::array();
  for (const std::string_view place : positions_in(list)) {
    ordered_json position = ordered_json::array();
    for (const std::string_view word : tagrid::words_of(place)) {
      const auto number = number_of(word);
      position.push_back(number && std::isfinite(*number) ? ordered_json(*number) : ordered_json(nullptr));
    }
    positions.push_back(std::move(position));
  }
  return positions;
}

ordered_json geometry_json(const TagHeader& header) {
  ordered_json json = {{"spacing", nullptr}, {"directions", nullptr},
                       {"origin", nullptr},  {"space", nullptr},
                       {"units", nullptr},   {"slice_positions", slice_positions(header)}};
  const Geometry g = header.metadata.geometry();
  // An unknown spacing is a NaN, which becomes null.
  if (g.has_spacing) json["spacing"] = g.spacing;
  if (g.has_directions) json["directions"] = g.directions;
  if (g.has_origin) json["origin"] = g.origin;
  if (!g.space.empty()) json["space"] = json_text(g.space);
  if (g.units == std::array<std::string, 3>()) return json;
  json["units"] = ordered_json::array();
  for (const std::string& unit : g.units) json["units"].push_back(json_text_or_null(unit));
  return json;
}

std::string vector_text(const std::array<double, 3>& v) {
  return fmt::format("({}, {}, {})", v[0], v[1], v[2]);
}

/// Three lengths along x, y and z with their units.
std::string lengths_text(const std::array<double, 3>& lengths, const std::array<std::string, 3>& units) {
  const bool one_unit = units[0] == units[1] && units[1] == units[2];
  std::string text;
  for (std::size_t i = 0; i < 3; ++i) {
    text += i > 0 ? " x " : "";
    text += std::isnan(lengths[i]) ? "unknown" : fmt::format("{:.6g}", lengths[i]);
    if (!one_unit && !units[i].empty()) text += fmt::format(" {}", printable(units[i]));
  }
  return one_unit && !units[0].empty() ? fmt::format("{} {}", text, printable(units[0])) : text;
}

/// What the file keeps of its source, as lines of an NRRD header. A name that comes twice has its last value.
ordered_json source_json(const TagHeader& header) {
  ordered_json json = {{"fields", ordered_json::object()},
                       {"pairs", ordered_json::object()},
                       {"comments", ordered_json::array()}};
  for (const MetadataEntry& entry : header.metadata.entries()) {
    if (entry.kind == MetadataEntry::Kind::field) {
      json["fields"][json_text(std::string(entry.field))] = json_text(std::string(entry.value));
    } else if (entry.kind == MetadataEntry::Kind::comment) {
      json["comments"].push_back(json_text(std::string(entry.line)));
    }
  }
  // A header writes an end of line and a backslash as two characters each.
  for (const auto& [key, text] : header.metadata.pairs()) json["pairs"][json_text(key)] = json_text(text);
  return json;
}

/// The position of the samples in the world, as far as the source gave it.
/// `line` takes the name and the value of a line.
template <class Line>
void print_geometry(const TagHeader& header, const Line& line) {
  const Geometry g = header.metadata.geometry();
  if (!g.has_spacing && !g.has_origin && g.space.empty()) return line("geometry", "not given by the source");
  if (g.has_spacing) {
    std::array<double, 3> size = {};
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      size[a] = std::abs(g.spacing[a]) * static_cast<double>(header.parameters.dims[axis]);
    }
    // Each slice counts as thick as the spacing says, the last one included.
    if (const auto distances = slice_distances(header.metadata, header.parameters.dims.z); !distances.empty())
      size[2] = distances.back() + std::abs(g.spacing[2]);
    // Units of coordinates are not units of axes, unless they are all the same.
    const auto& units = g.units;
    const bool fit = !g.has_directions || (units[0] == units[1] && units[1] == units[2]);
    line("spacing", lengths_text(g.spacing, fit ? units : std::array<std::string, 3>()));
    line("physical size", lengths_text(size, fit ? units : std::array<std::string, 3>()));
    if (!fit) line("units", printable(fmt::format("{}, {}, {}", units[0], units[1], units[2])));
  }
  if (g.has_directions)
    line("directions", fmt::format("{} {} {}", vector_text(g.directions[0]), vector_text(g.directions[1]),
                                   vector_text(g.directions[2])));
  if (g.has_origin) line("origin", vector_text(g.origin));
  if (!g.space.empty()) line("space", printable(g.space));
}

/// How values follow from samples: "2 * sample - 1024 HU". What the source does not say is "".
std::string values_text(const std::string& slope, const std::string& intercept, const std::string& units) {
  std::string text = slope.empty() ? "sample" : slope + " * sample";
  if (!intercept.empty()) text += intercept[0] == '-' ? " - " + intercept.substr(1) : " + " + intercept;
  return units.empty() ? text : text + " " + units;
}

/// What people should know of the source: what samples mean, whose they are, and that there is more.
template <class Line>
void print_source(const TagHeader& header, const Line& line) {
  const auto listed = header.metadata.pairs();
  const std::map<std::string, std::string> pairs(listed.begin(), listed.end());
  const auto text = [&](const char* key) {
    const auto found = pairs.find(key);
    return found == pairs.end() ? std::string() : printable(found->second);
  };
  if (header.metadata.has_slopes_of_slices())
    line("values", "individual slope and intercept of each slice; --json lists them");
  else if (pairs.contains("rescale_slope") || pairs.contains("rescale_intercept"))
    line("values", values_text(text("rescale_slope"), text("rescale_intercept"), text("rescale_units")));
  if (pairs.contains("slice_positions")) line("slices", "unequally spaced; --json lists their positions");
  if (pairs.contains("dicom_PatientName"))
    line("patient", fmt::format("{} ({})", text("dicom_PatientName"), text("dicom_PatientID")));
  if (!pairs.empty()) line("metadata", fmt::format("{} key/value pairs, which --json shows", pairs.size()));
}

/// How samples were compressed in the source files that are kept; "" if these can come back as they were.
std::string compression_of(const TagSummary& file) {
  const auto& beginning = file.beginning_of_envelope;
  return beginning.empty() ? "" : compression_in("the file", beginning);
}

std::string source_files_text(const TagSummary& file) {
  if (file.sizes.envelope == 0) return "not kept, except the fields that --json shows";
  const bool is_exact = file.header.parameters.is_exact();
  const std::string compression = compression_of(file),
                    decoded = is_exact ? "" : ", with the decoded samples";
  if (!compression.empty())
    // Readers of HDF5 call chunks without a filter so.
    return (compression == "chunks"
                ? std::string("can be restored, but contiguous instead of in chunks")
                : fmt::format("can be restored, but uncompressed ({})", printable(compression))) +
           decoded;
  return (is_exact ? "can be restored byte for byte" : "can be restored") + decoded;
}

ordered_json parity_json(const ParityLayout& layout, std::uint64_t bytes) {
  return {{"percent", layout.share / 1000.0}, {"bytes", bytes},
          {"blocks", layout.parity_blocks()}, {"block_bytes", layout.block_size()},
          {"any_blocks", layout.parity},      {"burst_bytes", layout.burst()}};
}

}  // namespace

ordered_json settings_json(const CodingParameters& p) {
  const ordered_json range = {number_or_null(p.range_low, true), number_or_null(p.range_high, true)};
  return {{"cube", p.cube_size},
          {"brick", p.brick_edge},
          {"accuracy", p.accuracy},
          {"field_scale", p.field_scale},
          {"range", p.range_low == p.range_high ? ordered_json(nullptr) : range},
          {"lead", p.lead},
          {"max_level", p.max_level},
          {"max_error", bound_or_null(p.max_error)},
          {"transform_step", number_or_null(p.transform_step, p.transform_step > 0)},
          {"surface_error", bound_or_null(p.surface_error)},
          {"thresholds", p.thresholds.numbers()},
          {"mesh_error", bound_or_null(p.mesh_error)},
          {"effort", name_of(p.effort)},
          {"mode", p.mode == FileMode::voxels ? "voxels" : "grid"},
          {"grid", name_of(p.grid)}};
}

namespace {

ordered_json thresholds_json(const TagHeader& header, const Statistics& total, bool is_scale_known) {
  const Rescale rescale = header.metadata.rescale();
  const Thresholds& thresholds = header.parameters.thresholds;
  ordered_json all = ordered_json::array();
  for (std::size_t i = 0; i < thresholds.count; ++i)
    all.push_back(
        {{"sample", thresholds.all[i]},
         {"value", number_or_null(rescale.slope * thresholds.all[i] + rescale.intercept, is_scale_known)},
         {"samples_at_least", total.at_least.all[i]},
         {"samples_moved", total.moved.all[i]}});
  return all;
}

}  // namespace

ordered_json achieved_json(const TagHeader& header, const Statistics& total) {
  const Achieved a = achieved_of(total);
  const bool is_known = !header.metadata.has_slopes_of_slices() && scale_doubt_in(header.metadata).empty();
  const Rescale rescale = header.metadata.rescale();
  const double slope = std::abs(rescale.slope);
  return {{"max_error", number_or_null(a.max_error, true)},
          {"rmse", a.rmse},
          {"psnr", std::isnan(a.psnr) ? ordered_json(nullptr) : ordered_json(a.psnr)},
          {"mesh_error", bound_or_null(total.mesh_error)},
          {"thresholds", thresholds_json(header, total, is_known)},
          {"max_error_in_values", number_or_null(slope * a.max_error, is_known)},
          {"rmse_in_values", number_or_null(slope * a.rmse, is_known)},
          {"units_of_values", json_text_or_null(is_known ? rescale.units : "")}};
}

ordered_json contents_json(const TagHeader& header, const Statistics& total) {
  const CodingParameters& p = header.parameters;
  return {{"dims", {p.dims.x, p.dims.y, p.dims.z}},
          {"volumes", header.volumes},
          {"type", name_of(p.type)},
          {"geometry", geometry_json(header)},
          {"max_error", bound_or_null(p.max_error)},
          {"mode", p.mode == FileMode::voxels ? "voxels" : "grid"},
          {"achieved", achieved_json(header, total)},
          {"pairs", source_json(header)["pairs"]}};
}

/// The errors of all volumes, or of volume 0 if the others are not known.
const Statistics& errors_of(const TagSummary& file) {
  return file.statistics ? *file.statistics : file.index.total;
}

/// Calls use(member, parameters) for each overview of a file.
void for_each_overview(const TagSummary& file, auto use) {
  std::size_t i = 0;
  for (const Member& member : file.index.members)
    if (member.is_overview()) use(member, file.overviews[i++]);
}

ordered_json overviews_json(const TagSummary& file) {
  ordered_json all = ordered_json::array();
  for_each_overview(file, [&](const Member& member, const std::optional<CodingParameters>& p) {
    const Index3 dims = overview_dims(file.header.parameters.dims, member.factor);
    all.push_back({{"factor", member.factor},
                   {"dims", {dims.x, dims.y, dims.z}},
                   {"bytes", member.bytes()},
                   {"max_error", p ? ordered_json(p->max_error) : ordered_json(nullptr)}});
  });
  return all;
}

ordered_json info_json(const TagSummary& file, bool with_levels) {
  const auto& [header, index, sizes, beginning, parity, overviews, volume_names, statistics] = file;
  ordered_json json;
  const Index3& n = header.parameters.dims;
  json["dims"] = {n.x, n.y, n.z};
  json["volumes"] = header.volumes;
  if (!volume_names.empty()) {
    json["volume_names"] = ordered_json::array();
    for (const std::string& name : volume_names) json["volume_names"].push_back(json_text(name));
  }
  json["type"] = name_of(header.parameters.type);
  json["geometry"] = geometry_json(header);
  json.update(settings_json(header.parameters));
  json["levels"] = nullptr;
  if (with_levels) {
    json["levels"] = ordered_json::array();
    for (const LevelRow& row : level_rows(header, index))
      json["levels"].push_back({{"level", row.level}, {"points", row.points}, {"active", row.active}});
  }
  json["bytes"] = {{"file", sizes.file},     {"header", sizes.header},     {"activity", sizes.activity},
                   {"values", sizes.values}, {"envelope", sizes.envelope}, {"members", sizes.members},
                   {"index", sizes.index}};
  json["filter"] =
      is_filter(header.parameters.filter) ? ordered_json(header.parameters.filter) : ordered_json(nullptr);
  json["overviews"] = overviews_json(file);
  if (parity) json["bytes"]["parity"] = sizes.parity;
  json["parity"] = parity ? parity_json(*parity, sizes.parity) : ordered_json(nullptr);
  json["achieved"] = achieved_json(header, errors_of(file));
  const std::string compression = compression_of(file);
  json["restorable"] = sizes.envelope > 0 && header.parameters.is_exact() && compression.empty();
  json["compression"] = json_text_or_null(compression);
  json["source"] = source_json(header);
  if (!index.unknown_sections.empty()) json["unknown_sections"] = index.unknown_sections;
  for (const Member& member : index.members)
    if (member.is_unknown())
      json["unknown_members"].push_back(
          {{"kind", member.kind}, {"factor", member.factor}, {"bytes", member.bytes()}});
  return json;
}

std::string info_text(const TagSummary& file, bool with_levels) {
  const auto& [header, index, sizes, beginning, parity, overviews, volume_names, statistics] = file;
  const CodingParameters& p = header.parameters;
  const auto n = static_cast<std::uint64_t>(Box::of_size(header.all_dims()).count());
  const std::uint64_t raw = n * size_of(p.type);
  std::string out;
  const auto line = [&](const char* name, const std::string& value) {
    out += fmt::format("{:<16}{}\n", name, value);
  };
  line("volume",
       fmt::format("{}{} x {} x {} {}, {}", header.volumes == 1 ? "" : fmt::format("{} of ", header.volumes),
                   p.dims.x, p.dims.y, p.dims.z, name_of(p.type), human_bytes(raw)));
  if (header.volumes > 1)
    line("", fmt::format("volumes 0 to {}{}; what follows on {}values and levels is of volume 0",
                         header.volumes - 1,
                         volume_names.empty() ? ""
                                              : fmt::format(" ({} to {})", printable(volume_names.front()),
                                                            printable(volume_names.back())),
                         statistics ? "" : "errors, "));
  print_geometry(header, line);
  print_source(header, line);
  line("source files", source_files_text(file));
  if (const std::string loss = header.metadata.text_of(lossy_source_key); !loss.empty())
    line("", fmt::format("was already compressed with loss: {}", printable(loss)));
  for (const std::string& doubt : doubts_in(header.metadata)) line("in doubt", printable(doubt));
  line("mode",
       p.mode == FileMode::voxels ? "voxels (every voxel is stored)" : "grid (voxels are interpolated)");
  const char* name_of_line = "overviews";
  for_each_overview(file, [&](const Member& member, const std::optional<CodingParameters>& o) {
    const Index3 dims = overview_dims(p.dims, member.factor);
    line(name_of_line,
         fmt::format("{}: {} x {} x {} means, {}, {}", member.factor, dims.x, dims.y, dims.z,
                     human_bytes(member.bytes()),
                     o ? "maximum error " + bound_text(o->max_error) : "damaged, or of a newer version"));
    name_of_line = "";
  });
  std::uint64_t unknown_bytes = 0;
  for (const Member& member : index.members) {
    if (!member.is_unknown()) continue;
    unknown_bytes += member.bytes();
    line("also has", fmt::format("a member of kind {}, {}, which this version does not know", member.kind,
                                 human_bytes(member.length)));
  }
  if (p.grid == GridOrigin::derived) line("grid", "derived (computed from the decoded voxels on demand)");
  if (p.grid == GridOrigin::implied) line("grid", "that of the original, which the voxels determine");
  line("effort", std::string(name_of(p.effort)));
  if (const auto& kinds = index.unknown_sections; !kinds.empty()) {
    const auto named = std::min<std::size_t>(kinds.size(), 10);
    line("also has",
         fmt::format("parts of a newer version, of kind {}{}, which are not needed for the samples",
                     fmt::join(std::span(kinds).first(named), ", "),
                     named < kinds.size() ? fmt::format(" and {} more", kinds.size() - named) : ""));
  }
  const Statistics& errors = errors_of(file);
  line("largest error",
       fmt::format("bound {}, reached {}", bound_text(p.max_error), error_text(errors.max_error, header)));
  if (p.transform_step > 0)
    line("wavelet", fmt::format("step {:.4g}, in bricks where it is smaller{}", p.transform_step,
                                is_filter(p.filter) ? "; filtered where that is closer" : ""));
  if (p.surface_error >= 0) line("", fmt::format("bound {} at active points", p.surface_error));
  const double counted_samples =
      static_cast<double>(p.dims.x * p.dims.y * p.dims.z) * (file.statistics ? header.volumes : 1);
  const char* upper_side = header.metadata.rescale().slope < 0 ? "at most" : "at least";
  for (std::size_t i = 0; i < p.thresholds.count; ++i)
    line(i == 0 ? "thresholds" : "",
         fmt::format("{}: {:.4g} % of the voxels are {} this; {} would have changed sides",
                     sample_text(p.thresholds.all[i], header),
                     100 * static_cast<double>(errors.at_least.all[i]) / counted_samples, upper_side,
                     errors.moved.all[i]));
  if (p.mesh_error >= 0)
    line("mesh error",
         fmt::format("bound {}, reached {}", p.mesh_error, error_text(errors.mesh_error, header)));
  const Achieved a = achieved_of(errors);
  line("rmse, psnr", errors.max_error == 0 ? "0, lossless"
                     : std::isnan(a.psnr)  ? fmt::format("{:.4f}, no psnr", a.rmse)
                                           : fmt::format("{:.4f}, {:.2f} dB", a.rmse, a.psnr));
  line("root cubes", fmt::format("edge {}, {} per edge of a brick, {}", p.cube_size, p.brick_edge,
                                 counted(p.bricks().count(), "brick")));
  line("accuracy",
       fmt::format(
           "m = {}, field scale {:.6g} voxels per unit{}", p.accuracy, p.field_scale,
           p.range_low == p.range_high ? "" : fmt::format(" (range {} .. {})", p.range_low, p.range_high)));
  const auto part = [&, whole = sizes.file](const char* name, std::uint64_t bytes) {
    line(name, fmt::format("{:>12}  {:5.1f} %  {:.4f} bits per voxel", bytes,
                           100.0 * static_cast<double>(bytes) / static_cast<double>(whole),
                           8.0 * static_cast<double>(bytes) / static_cast<double>(n)));
  };
  part("file", sizes.file);
  part("  header", sizes.header);
  part("  activity", sizes.activity);
  part("  values", sizes.values);
  if (sizes.envelope > 0) part("  source files", sizes.envelope);
  if (sizes.members > unknown_bytes)
    part(header.volumes > 1 ? "  other volumes" : "  overviews", sizes.members - unknown_bytes);
  if (unknown_bytes > 0) part("  other members", unknown_bytes);
  part("  index, frames", sizes.index);
  if (parity) part("  parity", sizes.parity);
  line("ratio", fmt::format("{:.2f}", static_cast<double>(raw) / static_cast<double>(sizes.file)));
  if (!with_levels) return out;
  out += fmt::format("\n{:>5} {:>14} {:>14} {:>9}\n", "level", "points", "active points", "percent");
  for (const LevelRow& row : level_rows(header, index))
    if (row.level <= p.max_level)
      out += fmt::format("{:>5} {:>14} {:>14} {:>9.2f}\n", row.level, row.points, row.active,
                         100.0 * static_cast<double>(row.active) / static_cast<double>(row.points));
  return out;
}

}  // namespace tagrid
