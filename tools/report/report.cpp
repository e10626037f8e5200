#include "tools/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/metadata/lengths.h"
#include "io/metadata/region.h"
#include "io/metadata/rescale.h"
#include "io/system/this_process.h"
#include "io/text/text.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/threads/node_times.h"
#include "tools/report/human_bytes.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

using nlohmann::ordered_json;

std::uint64_t voxels(const TagHeader& header) {
  return static_cast<std::uint64_t>(Box::of_size(header.all_dims()).count());
}

}  // namespace

std::string doubt_of_range(const TagHeader& header, const Statistics& total) {
  // A span of less than an eighth of a voxel, such as that of a mask, hardly refines the grid.
  constexpr double far_more = 4, far_less = 1.0 / 64;
  constexpr std::int64_t least = 1 << 14;  // samples: nobody makes a mesh of fewer
  const CodingParameters& p = header.parameters;
  const std::pair range(p.range_low, p.range_high);
  if (is_wide_type(p.type) || range != usual_range(p.type)) return "";
  const double span = total.high - total.low, made_for = p.range_high - p.range_low;
  const std::string grid =
      fmt::format("samples span {} to {}, but the grid was made for {} to {}, the usual range of {}",
                  total.low, total.high, p.range_low, p.range_high, name_of(p.type));
  if (span > 0 && span < far_less * made_for && p.mesh_error < 0 && Box::of_size(p.dims).count() >= least)
    return grid + ": it misses detail; encode with --range auto to follow it";
  if (span > far_more * made_for)
    return grid + ": it may be finer than you want; encode with --range auto if it is";
  return "";
}

std::string written_json(const ordered_json& json, int indent) {
  const std::string dumped = json.dump(indent, ' ', false, ordered_json::error_handler_t::replace);
  std::string text;
  for (std::string_view rest = dumped; !rest.empty();) {
    const auto first = static_cast<unsigned char>(rest[0]);
    const std::size_t bytes = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    const std::string_view character = rest.substr(0, bytes);
    rest.remove_prefix(bytes);
    // Only a string has a character that is not printable, except for the ends of lines between values.
    if (character == "\n" || printable(character) == character) {
      text += character;
      continue;
    }
    unsigned code = bytes == 1 ? first : first & (0x7FU >> bytes);
    for (const char byte : character.substr(1)) code = code << 6 | (static_cast<unsigned char>(byte) & 0x3FU);
    text += fmt::format("\\u{:04x}", code);
  }
  return text;
}

bool has_uneven_slices(const TagHeader& header) {
  return !header.metadata.text_of(slice_positions_key).empty();
}

std::string coordinates_text(const TagHeader& header) {
  const Geometry g = in_one_unit(header.metadata.geometry());
  const auto& units = g.units;
  std::string text = g.space.empty() ? "space unknown" : "space " + printable(g.space);
  if (!g.has_spacing) return text + ", in samples";
  if (units[0] == units[1] && units[1] == units[2] && !units[0].empty())
    text += ", in " + printable(units[0]);
  return text;
}

std::string json_text(const std::string& bytes) {
  using nlohmann::json;
  return json::parse(json(bytes).dump(-1, ' ', false, json::error_handler_t::replace)).get<std::string>();
}

ordered_json json_text_or_null(const std::string& bytes) {
  return bytes.empty() ? ordered_json(nullptr) : ordered_json(json_text(bytes));
}

std::string sample_text(double sample, const TagHeader& header) {
  const Rescale rescale = header.metadata.rescale();
  const std::string unit = rescale.units.empty() ? "" : " " + printable(rescale.units);
  if (rescale.slope == 1 && rescale.intercept == 0) return fmt::format("{}{}", sample, unit);
  return fmt::format("{:.10g}{} ({} in stored samples)", sample * rescale.slope + rescale.intercept, unit,
                     sample);
}

std::string error_text(double error, const TagHeader& header) {
  if (header.metadata.has_slopes_of_slices()) {
    const auto slices = rescale_of_slices(header.metadata, header.parameters.dims.z);
    const std::string of_samples = fmt::format("{} in stored samples", error);
    if (!slices || error <= 0) return of_samples;
    // In the other slices, it is less.
    return fmt::format("{} (at most {:.6g} in values)", of_samples, error * header.metadata.largest_slope());
  }
  const Rescale rescale = header.metadata.rescale();
  const std::string unit = rescale.units.empty() ? "" : " " + printable(rescale.units);
  if (rescale.slope == 1 && rescale.intercept == 0) return fmt::format("{}{}", error, unit);
  return fmt::format("{} in stored samples ({:.6g}{})", error, error * std::abs(rescale.slope),
                     unit.empty() ? " in values" : unit);
}

std::string summary(const EncodeResult& result) {
  const std::uint64_t n = voxels(result.header), raw = n * size_of(result.header.parameters.type);
  const auto file = static_cast<double>(result.file_bytes);
  return fmt::format("{} -> {}, ratio {:.2f}, {:.4f} bits per voxel, largest error {}", human_bytes(raw),
                     human_bytes(result.file_bytes), static_cast<double>(raw) / file,
                     8 * file / static_cast<double>(n),
                     error_text(result.index.total.max_error, result.header));
}

std::string summary(const DecodeResult& result) {
  const SampleType type = result.header.parameters.type;
  const std::uint64_t raw = voxels(result.header) * size_of(type);
  // Not of a part of the samples, of values in another type, or of what was compressed otherwise.
  const bool is_all = result.dims == result.header.parameters.dims && !result.is_one_of_several &&
                      size_of(result.numbers.type(type)) == size_of(type) && result.bytes_out >= raw;
  const std::string ratio =
      is_all ? fmt::format(", ratio {:.2f}", static_cast<double>(raw) / static_cast<double>(result.bytes_in))
             : "";
  return fmt::format("{} -> {}{}, largest error {}", human_bytes(result.bytes_in),
                     human_bytes(result.bytes_out), ratio,
                     error_text(result.index.total.max_error, result.header));
}

std::string memory_summary(std::uint64_t planned, std::optional<double> times_read) {
  // In the unit of -M.
  const auto mebibytes = [](std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); };
  const std::string memory = fmt::format("memory: {:.1f} MiB at its peak, {:.1f} MiB planned at most",
                                         mebibytes(peak_memory()), mebibytes(planned));
  return times_read ? fmt::format("{}; every sample read {:.2f} times", memory, *times_read) : memory;
}

std::vector<std::string> times_summary(const TagHeader& header) {
  const auto row = [&](std::string_view name, double seconds, std::string_view remark) {
    return fmt::format("{:<14}{:>10.3f}{:>14.3f}{}{}", name, seconds,
                       1e9 * seconds / static_cast<double>(voxels(header)), remark.empty() ? "" : "  ",
                       remark);
  };
  std::vector<std::string> lines = {fmt::format("{:<14}{:>10}{:>14}", "node", "CPU s", "ns per voxel")};
  double all = 0;
  NodeTime slowest;
  for (const NodeTime& node : node_times()) {
    if (node.seconds == 0) continue;
    lines.push_back(row(node.name, node.seconds, node.is_serial ? "one thread at a time" : ""));
    all += node.seconds;
    if (node.is_serial && node.seconds > slowest.seconds) slowest = node;
  }
  lines.push_back(
      row("all else", std::max(0.0, processor_seconds() - all), "a search, start, end, threads that wait"));
  const auto most = [&](double threads) { return std::min(threads, all / slowest.seconds); };
  if (slowest.seconds == 0) return lines;
  lines.push_back(
      fmt::format("at most {:.1f} times as fast with 16 threads and {:.1f} with 64", most(16), most(64)));
  if (most(64) < 64) lines.back() += fmt::format(", for \"{}\"", slowest.name);
  return lines;
}

}  // namespace tagrid
