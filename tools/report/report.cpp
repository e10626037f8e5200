#include "tools/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/region.h"
#include "io/formats/nrrd/rescale.h"
#include "io/text/text.h"
#include "io/volume/lengths.h"
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

bool has_uneven_slices(const TagHeader& header) {
  return !text_of_key(header.nrrd_fields, slice_positions_key).empty();
}

std::string coordinates_text(const TagHeader& header) {
  const Geometry g = in_one_unit(geometry_of(header.nrrd_fields));
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

std::string error_text(double error, const TagHeader& header) {
  if (has_slopes_of_slices(header.nrrd_fields)) return fmt::format("{} in stored samples", error);
  const Rescale rescale = rescale_of(header.nrrd_fields);
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
  const std::uint64_t raw = voxels(result.header) * size_of(result.header.parameters.type);
  return fmt::format("{} -> {}, ratio {:.2f}, largest error {}", human_bytes(result.bytes_in),
                     human_bytes(result.bytes_out),
                     static_cast<double>(raw) / static_cast<double>(result.bytes_in),
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
    return fmt::format("{:<14}{:>10.3f}{:>12.3f}{}{}", name, seconds,
                       1e9 * seconds / static_cast<double>(voxels(header)), remark.empty() ? "" : "  ",
                       remark);
  };
  std::vector<std::string> lines = {fmt::format("{:<14}{:>10}{:>12}", "node", "CPU s", "ns a voxel")};
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
