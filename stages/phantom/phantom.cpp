#include "stages/phantom/phantom.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

constexpr float lowest = -1024, highest = 3071;

/// The integers low to high - 1.
struct Interval {
  std::int64_t low, high;
};

/// The x coordinates in a row of nx voxels that are at most `reach` from `centre`.
Interval interval_around(double centre, double reach, std::int64_t nx) {
  const auto n = static_cast<double>(nx);
  const auto low = static_cast<std::int64_t>(std::ceil(std::clamp(centre - reach, 0.0, n)));
  const auto high = static_cast<std::int64_t>(std::floor(std::clamp(centre + reach, -1.0, n - 1))) + 1;
  return {low, std::max(low, high)};
}

/// One row of an ellipse.
struct EllipseRow {
  float cx, inverse_rx, qy, sharpness;
  float value, slope;  ///< HU at x = 0, and per voxel.

  void paint_edge(float* row, Interval x) const {
    for (std::int64_t i = x.low; i < x.high; ++i) {
      const auto position = static_cast<float>(static_cast<std::int32_t>(i));
      const float d = (position - cx) * inverse_rx;
      const float linear = 0.5f + (1.0f - (qy + d * d)) * sharpness;
      const float c = std::min(std::max(linear, 0.0f), 1.0f);
      const float coverage = c * c * (3.0f - 2.0f * c);
      row[i] += coverage * (value + slope * position - row[i]);
    }
  }

  void paint_inside(float* row, Interval x) const {
    for (std::int64_t i = x.low; i < x.high; ++i)
      row[i] = value + slope * static_cast<float>(static_cast<std::int32_t>(i));
  }
};

void paint_row(const PhantomEllipse& e, std::int64_t y, std::int64_t nx, float* row) {
  const double dy = static_cast<double>(y) - e.cy;
  const double qy = e.qz + dy / e.ry * (dy / e.ry);
  // Near the edge, the distance to it is about (1 - q) * r / 2.
  const double sharpness = std::min(e.rx, e.ry) / (2 * e.blur);
  const double outer = 1 + 0.5 / sharpness - qy, inner = 1 - 0.5 / sharpness - qy;
  if (outer <= 0) return;
  const EllipseRow part{static_cast<float>(e.cx),
                        static_cast<float>(1 / e.rx),
                        static_cast<float>(qy),
                        static_cast<float>(sharpness),
                        static_cast<float>(e.value + e.slope_y * dy - e.slope_x * e.cx),
                        static_cast<float>(e.slope_x)};
  const Interval all = interval_around(e.cx, e.rx * std::sqrt(outer), nx);
  if (inner <= 0) return part.paint_edge(row, all);
  const Interval inside = interval_around(e.cx, e.rx * std::sqrt(inner), nx);
  if (inside.low >= inside.high) return part.paint_edge(row, all);
  part.paint_edge(row, {all.low, inside.low});
  part.paint_inside(row, inside);
  part.paint_edge(row, {inside.high, all.high});
}

/// For each row, the ellipses that may touch it, in the order of painting.
std::vector<std::vector<std::int32_t>> ellipses_by_row(const std::vector<PhantomEllipse>& ellipses,
                                                       std::int64_t ny) {
  std::vector<std::vector<std::int32_t>> rows(static_cast<std::size_t>(ny));
  for (std::size_t i = 0; i < ellipses.size(); ++i) {
    const PhantomEllipse& e = ellipses[i];
    const double reach = 1 + e.blur / std::min(e.rx, e.ry) - e.qz;
    if (reach <= 0) continue;
    const Interval y = interval_around(e.cy, e.ry * std::sqrt(reach), ny);
    for (std::int64_t j = y.low; j < y.high; ++j)
      rows[static_cast<std::size_t>(j)].push_back(static_cast<std::int32_t>(i));
  }
  return rows;
}

/// White noise for x = -1 .. nx: sums of four uniform bytes, which are close to Gaussian, with a standard
/// deviation of 148.
void white_noise_row(std::uint64_t slice_key, std::int64_t y, std::vector<std::int32_t>& row) {
  const auto key = static_cast<std::uint32_t>(phantom_hash(slice_key, static_cast<std::uint64_t>(y)));
  const auto count = static_cast<std::uint32_t>(row.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    // A 32-bit mix with two multiplications, which vectorizes.
    std::uint32_t h = key + i * 0x9e3779b9u;
    h = (h ^ (h >> 16)) * 0x7feb352du;
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    h ^= h >> 16;
    const std::uint32_t pairs = (h & 0x00ff00ffu) + ((h >> 8) & 0x00ff00ffu);
    row[i] = static_cast<std::int32_t>((pairs & 0xffffu) + (pairs >> 16)) - 510;
  }
}

/// The noise of a slice, row by row from y = 0 on: white noise blurred with (1, 2, 1) / 4 along x and y.
class SliceNoise {
 public:
  SliceNoise(std::uint64_t slice_key, std::int64_t nx)
      : key_(slice_key), column_(static_cast<std::size_t>(nx) + 2) {
    for (auto& row : white_) row.resize(column_.size());
    white_noise_row(key_, -1, white_[1]);
    white_noise_row(key_, 0, white_[2]);
  }

  /// Adds the noise of the next row. Its standard deviation is a + b * (x - centre)^2.
  void add_next(float* row, std::int64_t nx, float a, float b, float centre) {
    std::swap(white_[0], white_[1]);
    std::swap(white_[1], white_[2]);
    white_noise_row(key_, ++y_, white_[2]);
    for (std::size_t i = 0; i < column_.size(); ++i)
      column_[i] = white_[0][i] + 2 * white_[1][i] + white_[2][i];
    constexpr float scale = 1.0f / 887;
    for (std::int64_t x = 0; x < nx; ++x) {
      const std::int32_t* c = column_.data() + x;
      const auto noise = static_cast<float>(c[0] + 2 * c[1] + c[2]);
      const float d = static_cast<float>(static_cast<std::int32_t>(x)) - centre;
      row[x] += noise * ((a + b * (d * d)) * scale);
    }
  }

 private:
  std::uint64_t key_;
  std::int64_t y_ = 0;
  std::vector<std::int32_t> white_[3], column_;
};

template <class T>
T sample_of(float hu) {
  const float clamped = std::min(std::max(hu, lowest), highest);
  if constexpr (std::is_floating_point_v<T>) {
    return clamped;
  } else {
    // Truncation rounds, as nothing is negative here.
    const float step = sizeof(T) == 1 ? 0.1f : 1.0f;
    const auto level = static_cast<std::int32_t>((clamped - lowest) * step + 0.5f);
    if constexpr (sizeof(T) == 1)
      return static_cast<T>(std::min(level, 255) + std::numeric_limits<T>::min());
    else
      return static_cast<T>(level + (std::is_signed_v<T> ? -1024 : 0));
  }
}

}  // namespace

template <class T>
void phantom_slice(const Index3& dims, std::uint64_t seed, std::int64_t z, std::span<T> out) {
  const std::int64_t nx = dims.x, ny = dims.y;
  assert(nx > 0 && ny > 0 && z >= 0 && z < dims.z && static_cast<std::int64_t>(out.size()) == nx * ny);
  const std::vector<PhantomEllipse> ellipses = phantom_ellipses(dims, seed, z);
  const auto rows = ellipses_by_row(ellipses, ny);
  SliceNoise noise(phantom_hash(seed ^ 0x6e6f697365u, static_cast<std::uint64_t>(z)), nx);
  std::vector<float> row(static_cast<std::size_t>(nx));
  const double half_x = static_cast<double>(nx) / 2, half_y = static_cast<double>(ny) / 2;
  for (std::int64_t y = 0; y < ny; ++y) {
    std::fill(row.begin(), row.end(), static_cast<float>(phantom_air));
    for (std::int32_t i : rows[static_cast<std::size_t>(y)])
      paint_row(ellipses[static_cast<std::size_t>(i)], y, nx, row.data());

    // Less noise towards the rim, as there is less to absorb the rays.
    const double dy = (static_cast<double>(y) + 0.5) / half_y - 1;
    noise.add_next(row.data(), nx, static_cast<float>(16 - 10 * dy * dy),
                   static_cast<float>(-10 / (half_x * half_x)), static_cast<float>(half_x - 0.5));

    const Interval seen = interval_around(half_x - 0.5, half_x * std::sqrt(std::max(0.0, 1 - dy * dy)), nx);
    std::fill(row.begin(), row.begin() + seen.low, lowest);
    std::fill(row.begin() + seen.high, row.end(), lowest);
    T* to = out.data() + y * nx;
    for (std::int64_t x = 0; x < nx; ++x) to[x] = sample_of<T>(row[static_cast<std::size_t>(x)]);
  }
}

#define TAGRID_INSTANTIATE(T) \
  template void phantom_slice(const Index3&, std::uint64_t, std::int64_t, std::span<T>);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
