#include "pipeline/raw/likelier_reading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/file_bytes.h"
#include "io/formats/nrrd/header.h"

namespace tagrid {
namespace {

constexpr std::int64_t stretch_count = 32, stretch_length = 256;
// Distant slices differ more than neighboring rows; the right order must not be suspected because of that.
constexpr double much_smoother = 2;
constexpr std::int64_t least_size = 4;

std::vector<double> read_samples(FileBytes& file, const RawDescription& raw, std::int64_t first,
                                 std::int64_t count) {
  const std::size_t size = size_of(raw.type);
  std::vector<std::byte> bytes(static_cast<std::size_t>(count) * size);
  file.seek(raw.offset + static_cast<std::uint64_t>(first) * size);
  file.read(bytes.data(), bytes.size());
  swap_if_not_native(bytes.data(), static_cast<std::size_t>(count), size, raw.big_endian.value_or(false));
  std::vector<double> values;
  with_sample_type(raw.type, [&](auto type) {
    const auto* samples = reinterpret_cast<const decltype(type)*>(bytes.data());
    values.assign(samples, samples + count);
  });
  return values;
}

/// The mean difference between samples that are dims.x (neighbors along y) and dims.x * dims.y apart.
double roughness(FileBytes& file, const RawDescription& raw, const Index3& dims, std::int64_t total) {
  double sum = 0, count = 0;
  for (const std::int64_t apart : {dims.x, dims.x * dims.y}) {
    const std::int64_t length = std::min(stretch_length, total - apart);
    for (std::int64_t i = 0; i < stretch_count; ++i) {
      const auto part = (static_cast<double>(i) + 0.5) / static_cast<double>(stretch_count);
      const auto first = static_cast<std::int64_t>(part * static_cast<double>(total - apart - length));
      const std::vector<double> here = read_samples(file, raw, first, length),
                                there = read_samples(file, raw, first + apart, length);
      for (std::size_t k = 0; k < here.size(); ++k) {
        const double difference = std::abs(here[k] - there[k]);
        if (!std::isfinite(difference)) continue;
        sum += difference;
        ++count;
      }
    }
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

bool fits(FileBytes& file, const RawDescription& raw) {
  const auto bytes = sample_bytes(raw.dims, raw.type);
  if (!bytes || !file.size() || *file.size() < raw.offset || *file.size() - raw.offset != *bytes)
    return false;
  return raw.offset > 0 || !begins_nrrd(file.peek(9));
}

std::optional<Index3> likelier_dims(const std::string& path, const RawDescription& raw) {
  std::array<std::int64_t, 3> sizes = {raw.dims.x, raw.dims.y, raw.dims.z};
  std::sort(sizes.begin(), sizes.end());
  if (path == "-" || sizes[0] < least_size || sizes[0] == sizes[2]) return std::nullopt;
  FileBytes file(path);
  if (!fits(file, raw)) return std::nullopt;
  const std::int64_t total = raw.dims.x * raw.dims.y * raw.dims.z;
  const double given = roughness(file, raw, raw.dims, total);
  std::optional<Index3> likelier;
  double least = given / much_smoother;
  do {
    const Index3 other = {sizes[0], sizes[1], sizes[2]};
    if (const double r = roughness(file, raw, other, total); r < least) {
      least = r;
      likelier = other;
    }
  } while (std::next_permutation(sizes.begin(), sizes.end()));
  return likelier;
}

}  // namespace tagrid
