#include "tools/report/report.h"

#include <fmt/format.h>

#include <cmath>

#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/region.h"
#include "io/formats/nrrd/rescale.h"
#include "io/text/text.h"
#include "io/volume/lengths.h"
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

}  // namespace tagrid
