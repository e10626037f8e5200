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

/// Positions and radii are in half widths: the field of view is x, y = -1 .. 1, and z has the mean scale of x
/// and y.
struct Position {
  double x, y, z;
};

/// An ellipsoid around `centre`, whose z is relative to the slice.
struct Ellipsoid {
  Position centre, radius;
};

/// HU of tissues.
constexpr double air = phantom_air, fat = -100, water = 0, muscle = 55, spongy_bone = 280, hard_bone = 1150,
                 metal = 2600;

class Scene {
 public:
  Scene(const Index3& dims, std::uint64_t seed, std::int64_t z)
      : seed_(seed),
        z_(z),
        half_x_(static_cast<double>(dims.x) / 2),
        half_y_(static_cast<double>(dims.y) / 2),
        half_z_(std::max(8.0, (half_x_ + half_y_) / 2)) {}

  double half_z() const { return half_z_; }
  std::vector<PhantomEllipse>& ellipses() { return ellipses_; }

  /// A number in [0, 1) for each (channel, index).
  double uniform(std::uint64_t channel, std::int64_t index) const { return uniform(channel, {0, 0, index}); }
  double uniform(std::uint64_t channel, const Index3& index) const {
    std::uint64_t h = phantom_hash(seed_, channel);
    for (int axis = 0; axis < 3; ++axis) h = phantom_hash(h, static_cast<std::uint64_t>(index[axis]));
    return static_cast<double>(h >> 11) * 0x1p-53;
  }

  /// A smooth function of z from -1 to 1, a different one for each channel.
  double drift(std::uint64_t channel) const {
    const std::int64_t period = voxels(0.9);
    const std::int64_t k = z_ / period;
    const double t = static_cast<double>(z_ % period) / static_cast<double>(period);
    const double s = t * t * (3 - 2 * t);
    return 2 * ((1 - s) * uniform(channel, k) + s * uniform(channel, k + 1)) - 1;
  }

  /// Calls f(k, dz) for each item k of a row along z, with one item every `period`, that is less than `reach`
  /// away from the slice; dz is its position relative to the slice.
  template <class F>
  void each_near(double period, double reach, F&& f) const {
    const std::int64_t step = voxels(period);
    const auto far = static_cast<std::int64_t>(reach * half_z_ / static_cast<double>(step)) + 2;
    for (std::int64_t k = z_ / step - far; k <= z_ / step + far; ++k) {
      const double dz = (static_cast<double>(k * step - z_) + static_cast<double>(step) / 2) / half_z_;
      if (std::abs(dz) < reach) f(k, dz);
    }
  }

  /// Paints an ellipsoid; with `drum`, one with flat ends. `rise` is in HU per half width along x and y.
  void paint(const Ellipsoid& e, double value, double blur, bool drum = false, Position rise = {0, 0, 0}) {
    double qz = e.centre.z / e.radius.z;
    qz *= qz;
    if (drum) qz = qz * qz * qz;
    if (qz >= 1.5 || e.radius.x <= 0 || e.radius.y <= 0) return;
    ellipses_.push_back({(e.centre.x + 1) * half_x_ - 0.5, (e.centre.y + 1) * half_y_ - 0.5,
                         e.radius.x * half_x_, e.radius.y * half_y_, qz, blur, value, rise.x / half_x_,
                         rise.y / half_y_});
  }

  /// The same ellipsoid, smaller by `by` on all sides, but by at least `voxels`.
  Ellipsoid inside(Ellipsoid e, double by, double voxels) const {
    e.radius.x -= std::max(by, voxels / half_x_);
    e.radius.y -= std::max(by, voxels / half_y_);
    e.radius.z = std::max(e.radius.z - std::max(by, voxels / half_z_), 1e-3);
    return e;
  }

  std::int64_t voxels(double length) const {
    return std::max<std::int64_t>(4, static_cast<std::int64_t>(length * half_z_ + 0.5));
  }

 private:
  std::uint64_t seed_;
  std::int64_t z_;
  double half_x_, half_y_, half_z_;
  std::vector<PhantomEllipse> ellipses_;
};

constexpr double endless = 1e6;
constexpr double segment_period = 2.6;
constexpr double vertebra_period = 0.23;

void paint_table(Scene& scene) {
  Ellipsoid table{{0, -0.42, 0}, {0.85, 1.20, endless}};
  scene.paint(table, 150, 1.5);
  scene.paint(table = scene.inside(table, 0.006, 1.2), -880, 1.5);
  scene.paint(table = scene.inside(table, 0.05, 3), 150, 1.5);
  scene.paint(scene.inside(table, 0.006, 1.2), air, 1.5);
}

/// Skin, fat and muscle; returns the outline of the muscle.
Ellipsoid paint_body(Scene& scene) {
  Ellipsoid body{{0.03 * scene.drift(0), -0.02 + 0.02 * scene.drift(1), 0},
                 {0.82 + 0.05 * scene.drift(2), 0.62 + 0.05 * scene.drift(3), endless}};
  scene.paint(body, 20, 2);
  scene.paint(body = scene.inside(body, 0.012, 1.5), fat, 2, false, {8, 12, 0});
  scene.paint(body = scene.inside(body, 0.065 + 0.03 * scene.drift(4), 2), muscle, 2.5, false, {10, -14, 0});
  return body;
}

/// True if the centre of `p` is in the ellipsoid scaled by `scale`.
bool contains(const Ellipsoid& e, const Position& p, double scale) {
  const double x = (p.x - e.centre.x) / e.radius.x, y = (p.y - e.centre.y) / e.radius.y,
               z = (p.z - e.centre.z) / e.radius.z;
  return x * x + y * y + z * z < scale * scale;
}

/// Fills an ellipsoid with one ball for each place of a jittered lattice: paint_ball(ball, u) with u in [0,
/// 1). No ball reaches further than `spacing` from its place.
template <class F>
void fill_with_balls(Scene& scene, const Ellipsoid& region, double spacing, std::uint64_t channel,
                     F&& paint_ball) {
  spacing = std::max(spacing, 6 / scene.half_z());
  const auto low_x = static_cast<std::int64_t>(std::floor((region.centre.x - region.radius.x) / spacing));
  const auto high_x = static_cast<std::int64_t>(std::ceil((region.centre.x + region.radius.x) / spacing));
  const auto low_y = static_cast<std::int64_t>(std::floor((region.centre.y - region.radius.y) / spacing));
  const auto high_y = static_cast<std::int64_t>(std::ceil((region.centre.y + region.radius.y) / spacing));
  scene.each_near(spacing, spacing, [&](std::int64_t k, double dz) {
    for (std::int64_t j = low_y; j < high_y; ++j)
      for (std::int64_t i = low_x; i < high_x; ++i) {
        const Index3 index{i, j, k};
        const auto shake = [&](std::uint64_t n) { return 0.5 * (scene.uniform(channel + n, index) - 0.5); };
        const Position centre{(static_cast<double>(i) + 0.5 + shake(0)) * spacing,
                              (static_cast<double>(j) + 0.5 + shake(1)) * spacing, dz + shake(2) * spacing};
        if (!contains(region, centre, 0.92)) continue;
        const double u = scene.uniform(channel + 3, index);
        const double radius = spacing * (0.15 + 0.33 * scene.uniform(channel + 4, index));
        paint_ball(Ellipsoid{centre, {radius, radius, radius}}, u);
      }
  });
}

void paint_lungs(Scene& scene, std::int64_t k, double dz) {
  for (int side = -1; side <= 1; side += 2) {
    const double size = 0.92 + 0.12 * scene.uniform(20, 2 * k + (side > 0));
    const Ellipsoid lung{{0.40 * side, -0.08, dz}, {0.27 * size, 0.36 * size, 0.85}};
    scene.paint(lung, -850, 2.5, false, {0, 90, 0});
    fill_with_balls(scene, lung, 0.075, side > 0 ? 100 : 110, [&](const Ellipsoid& ball, double u) {
      Ellipsoid vessel = ball;
      vessel.radius.x *= 0.55;
      vessel.radius.y *= 0.55;
      scene.paint(vessel, -150 + 250 * u, 2);
    });
  }
  const Ellipsoid heart{{0.08, -0.17, dz + 0.15}, {0.23, 0.21, 0.38}};
  scene.paint(heart, 70, 2.5, false, {20, 10, 0});
  scene.paint({{0.13, -0.19, dz + 0.15}, {0.12, 0.13, 0.25}}, 240, 2.5);
  Ellipsoid windpipe{{0.01, 0.08, dz - 0.3}, {0.055, 0.05, 0.6}};
  scene.paint(windpipe, 40, 1.5, true);
  scene.paint(scene.inside(windpipe, 0.012, 1.5), air, 1.5, true);
}

void paint_bowel_ball(Scene& scene, const Ellipsoid& ball, double u) {
  scene.paint(ball, 60, 1.5);
  const Ellipsoid content = scene.inside(ball, 0.006, 1.5);
  scene.paint(content, u < 0.45 ? air : u < 0.65 ? 320 : water + 40 * u, 1.5);
}

void paint_abdomen(Scene& scene, std::int64_t k, double dz) {
  const double size = 0.9 + 0.2 * scene.uniform(21, k);
  scene.paint({{-0.33, -0.10, dz - 0.3}, {0.36 * size, 0.33 * size, 0.42}}, 115, 2.5, false, {12, -10, 0});
  scene.paint({{0.50, 0.08, dz - 0.35}, {0.14, 0.20, 0.24}}, 130, 2.5);
  for (int side = -1; side <= 1; side += 2) {
    const Ellipsoid kidney{{0.33 * side, 0.22, dz + 0.05 * side}, {0.11, 0.13, 0.22}};
    scene.paint(kidney, 190, 2);
    scene.paint({{0.29 * side, 0.22, dz + 0.05 * side}, {0.05, 0.06, 0.12}}, 10 + 300 * scene.uniform(22, k),
                2);
  }
  const Ellipsoid bowel{{0.08, -0.22, dz + 0.35}, {0.52, 0.27, 0.5}};
  fill_with_balls(scene, bowel, 0.11, 120,
                  [&](const Ellipsoid& ball, double u) { paint_bowel_ball(scene, ball, u); });
  scene.paint({{0.2, -0.1, dz + 0.1 * scene.uniform(23, k)}, {0.02, 0.02, 0.02}}, metal, 1.5);
}

void paint_bone(Scene& scene, const Ellipsoid& bone, double wall, bool drum) {
  scene.paint(bone, hard_bone, 2, drum);
  scene.paint(scene.inside(bone, wall, 1.8), spongy_bone, 2, drum);
}

void paint_vertebra(Scene& scene, double shift, double dz) {
  const Ellipsoid body{{shift, 0.27, dz}, {0.135, 0.105, 0.095}};
  paint_bone(scene, {{shift, 0.53, dz - 0.02}, {0.028, 0.085, 0.07}}, 0.012, false);
  for (int side = -1; side <= 1; side += 2)
    paint_bone(scene, {{shift + 0.14 * side, 0.41, dz}, {0.10, 0.03, 0.045}}, 0.01, false);
  scene.paint({{shift, 0.41, dz}, {0.085, 0.075, 0.085}}, hard_bone * 0.8, 2, true);
  paint_bone(scene, body, 0.014, true);
  fill_with_balls(scene, body, 0.028, 130,
                  [&](const Ellipsoid& ball, double u) { scene.paint(ball, u < 0.6 ? 60 : 620, 2); });
}

void paint_spine(Scene& scene) {
  const double shift = 0.03 * scene.drift(5);
  scene.paint({{shift, 0.27, 0}, {0.12, 0.09, endless}}, 95, 2);
  scene.each_near(vertebra_period, 0.12, [&](std::int64_t, double dz) { paint_vertebra(scene, shift, dz); });
  scene.paint({{shift, 0.41, 0}, {0.055, 0.045, endless}}, 30, 2);
  // Aorta with a calcified wall.
  Ellipsoid aorta{{shift + 0.04, 0.12 + 0.02 * scene.drift(6), 0}, {0.055, 0.05, endless}};
  scene.paint(aorta, 90 + 300 * std::max(0.0, scene.drift(7)), 1.5);
  scene.paint(scene.inside(aorta, 0.01, 1.5), 210, 1.5);
}

/// Each rib goes from the back around to the front and downwards at the same time, so that a slice cuts
/// several ribs.
void paint_ribs(Scene& scene, const Ellipsoid& wall) {
  constexpr double length = 0.75;
  scene.each_near(vertebra_period, length, [&](std::int64_t, double dz) {
    const double t = 2 * (-dz / length) - 1;
    if (t < -0.8 || t > 0.75) return;
    // The circle in rational form: no sine needed.
    const double out = (1 - t * t) / (1 + t * t), forward = 2 * t / (1 + t * t);
    for (int side = -1; side <= 1; side += 2)
      paint_bone(scene,
                 {{wall.centre.x + side * out * (wall.radius.x - 0.04),
                   wall.centre.y - forward * (wall.radius.y - 0.04), 0},
                  {0.024 + 0.05 * std::abs(forward), 0.024 + 0.05 * out, endless}},
                 0.01, false);
  });
}

}  // namespace

std::vector<PhantomEllipse> phantom_ellipses(const Index3& dims, std::uint64_t seed, std::int64_t z) {
  Scene scene(dims, seed, z);
  paint_table(scene);
  const Ellipsoid wall = paint_body(scene);
  scene.each_near(segment_period, 1.5, [&](std::int64_t k, double dz) { paint_lungs(scene, k, dz - 0.45); });
  scene.each_near(segment_period, 1.5,
                  [&](std::int64_t k, double dz) { paint_abdomen(scene, k, dz + 0.85); });
  paint_ribs(scene, wall);
  paint_spine(scene);
  return std::move(scene.ellipses());
}

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
