#include "stages/materials/material_field.h"

#include <cmath>
#include <utility>

namespace tagrid {

Box SamplePlaces::around(const Box& points, double reach) const {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = along(axis, points.low[axis] * parts_per_point);
    const double high = along(axis, points.high[axis] * parts_per_point);
    box.low[axis] = std::max<std::int64_t>(0, static_cast<std::int64_t>(std::floor(low - reach)));
    box.high[axis] = std::min(dims[axis] - 1, static_cast<std::int64_t>(std::ceil(high + reach)));
  }
  return box;
}

ValueField::Along ValueField::along(int axis, std::int64_t position) const {
  const double x = places_.along(axis, position);
  const std::int64_t last_pair = std::max<std::int64_t>(places_.dims[axis] - 2, 0);
  const std::int64_t first = std::min(static_cast<std::int64_t>(x), last_pair);
  return {first, static_cast<float>(x - static_cast<double>(first))};
}

float ValueField::value(const Along& x, const Along& y, const Along& z) const {
  const Index3& dims = places_.dims;
  const std::int64_t to_x = dims.x > 1 ? 1 : 0, to_y = dims.y > 1 ? 1 : 0, to_z = dims.z > 1 ? 1 : 0;
  const auto row = [&](std::int64_t j, std::int64_t k) {
    const float* const s = &samples_.at({x.first, j, k});
    return s[0] + x.part * (s[to_x] - s[0]);
  };
  const auto plane = [&](std::int64_t k) {
    const float low = row(y.first, k);
    return low + y.part * (row(y.first + to_y, k) - low);
  };
  const float low = plane(z.first);
  return low + z.part * (plane(z.first + to_z) - low);
}

Material ValueField::material_of(float value) const {
  Material n = 0;
  for (const float t : thresholds_) n = static_cast<Material>(n + (value >= t));
  return n;
}

void ValueField::find_materials(Index3 first, std::span<Material> to) const {
  const Along y = along(1, first.y * parts_per_point), z = along(2, first.z * parts_per_point);
  for (std::size_t i = 0; i < to.size(); i += 2)
    to[i] = material_of(value(along(0, (first.x + static_cast<std::int64_t>(i)) * parts_per_point), y, z));
}

std::int32_t ValueField::find_cut(Index3 p, Index3 direction, Material a, Material b) const {
  // Where other materials lie between the two, the middle of the first and the last threshold decides.
  const float first = thresholds_[std::min(a, b)], last = thresholds_[std::max(a, b) - 1U];
  const float threshold = first + (last - first) / 2;
  return bisect(
      [&](std::int32_t step) { return (value_at(position_of(p, direction, step)) >= threshold) == (a > b); });
}

LabelField::Weights LabelField::weights(int axis, std::int64_t position) const {
  const double x = places_.along(axis, position), reach_of_all = reach(radius_);
  const auto last = static_cast<double>(places_.dims[axis] - 1);
  const auto from = static_cast<std::int64_t>(std::ceil(std::max(0.0, x - reach_of_all)));
  const auto to = static_cast<std::int64_t>(std::floor(std::min(last, x + reach_of_all)));
  Weights w{from, static_cast<std::uint32_t>(to - from + 1), {}};
  for (std::uint32_t i = 0; i < w.count; ++i) {
    const double d = std::abs(static_cast<double>(from + i) - x);
    double weight;
    if (radius_ == 0) {
      weight = 1 - d;
    } else {
      const double u = d / radius_, rest = 2 - u;
      weight = u < 1 ? (4 + u * u * (3 * u - 6)) / 6 : rest * rest * rest / 6;
    }
    w.of[i] = static_cast<std::int32_t>(weight * 65536 + 0.5);
  }
  return w;
}

template <class Visit>
void LabelField::for_each_sample(const Weights& x, const Weights& y, const Weights& z, Visit visit) const {
  for (std::uint32_t k = 0; k < z.count; ++k)
    for (std::uint32_t j = 0; j < y.count; ++j) {
      const std::int64_t of_row = std::int64_t{z.of[k]} * y.of[j];
      const Material* const row = &samples_.at({x.first, y.first + j, z.first + k});
      for (std::uint32_t i = 0; i < x.count; ++i) visit(row[i], of_row * x.of[i]);
    }
}

Material LabelField::heaviest(const Weights& x, const Weights& y, const Weights& z) const {
  // Most positions have samples of one label, and few have many: pairs of a label and its weight.
  const Material first = samples_.at({x.first, y.first, z.first});
  bool has_others = false;
  for_each_sample(x, y, z, [&](Material label, std::int64_t) { has_others |= label != first; });
  if (!has_others) return first;
  constexpr std::size_t usual = 8;
  std::array<std::pair<Material, std::int64_t>, usual> sums;
  std::vector<std::pair<Material, std::int64_t>> more;
  std::size_t count = 0;
  for_each_sample(x, y, z, [&](Material label, std::int64_t weight) {
    const auto is_it = [&](const auto& sum) { return sum.first == label; };
    if (const auto sum = std::find_if(sums.begin(), sums.begin() + count, is_it); sum != sums.begin() + count)
      sum->second += weight;
    else if (const auto other = std::find_if(more.begin(), more.end(), is_it); other != more.end())
      other->second += weight;
    else if (count < usual)
      sums[count++] = {label, weight};
    else
      more.emplace_back(label, weight);
  });
  std::pair<Material, std::int64_t> best = sums[0];
  const auto compare = [&](const auto& sum) {
    if (sum.second > best.second || (sum.second == best.second && sum.first < best.first)) best = sum;
  };
  std::for_each(sums.begin(), sums.begin() + count, compare);
  std::for_each(more.begin(), more.end(), compare);
  return best.first;
}

void LabelField::find_materials(Index3 first, std::span<Material> to) const {
  const Weights y = weights(1, first.y * parts_per_point), z = weights(2, first.z * parts_per_point);
  for (std::size_t i = 0; i < to.size(); i += 2)
    to[i] = heaviest(weights(0, (first.x + static_cast<std::int64_t>(i)) * parts_per_point), y, z);
}

std::int32_t LabelField::find_cut(Index3 p, Index3 direction, Material a, Material b) const {
  return bisect([&](std::int32_t step) {
    const Index3 position = position_of(p, direction, step);
    std::int64_t more_of_a = 0;
    for_each_sample(weights(0, position.x), weights(1, position.y), weights(2, position.z),
                    [&](Material label, std::int64_t weight) {
                      more_of_a += label == a ? weight : label == b ? -weight : 0;
                    });
    return more_of_a > 0 || (more_of_a == 0 && a < b);
  });
}

}  // namespace tagrid
