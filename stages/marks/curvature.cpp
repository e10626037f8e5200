#include "stages/marks/curvature.h"

#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include "stages/volume/sample_type.h"
#include "stages/volume/vector_code.h"

namespace tagrid {
namespace {

// Sums over the 3x3 rows around a row, each with a stencil in y and one in z: b = (1,4,1), d = (-1,0,1), c =
// (1,-2,1). They are exact: in 32 bits for integers of up to 16 bits, in 53 bits for heights.
template <class Sum>
struct RowSums {
  std::vector<Sum> bb, db, bd, cb, bc, dd;

  void resize(std::size_t n) {
    for (auto* v : {&bb, &db, &bd, &cb, &bc, &dd}) v->resize(n);
  }
};

template <class T>
struct NineRows {
  std::array<const T*, 9> at;  // [3 * (z + 1) + (y + 1)]
};

template <class T, class Sum>
inline __attribute__((always_inline)) void sum_rows(const NineRows<T>& rows, std::int64_t n,
                                                    RowSums<Sum>& sums) {
  const auto& r = rows.at;
  Sum* __restrict bb = sums.bb.data();
  Sum* __restrict db = sums.db.data();
  Sum* __restrict bd = sums.bd.data();
  Sum* __restrict cb = sums.cb.data();
  Sum* __restrict bc = sums.bc.data();
  Sum* __restrict dd = sums.dd.data();
  TAGRID_INDEPENDENT
  for (std::int64_t i = 0; i < n; ++i) {
    const Sum b0 = r[0][i] + 4 * r[1][i] + r[2][i], d0 = r[2][i] - r[0][i];
    const Sum b1 = r[3][i] + 4 * r[4][i] + r[5][i], d1 = r[5][i] - r[3][i];
    const Sum b2 = r[6][i] + 4 * r[7][i] + r[8][i], d2 = r[8][i] - r[6][i];
    const Sum c0 = b0 - 6 * r[1][i], c1 = b1 - 6 * r[4][i], c2 = b2 - 6 * r[7][i];
    bb[i] = b0 + 4 * b1 + b2;
    db[i] = d0 + 4 * d1 + d2;
    cb[i] = c0 + 4 * c1 + c2;
    bd[i] = b2 - b0;
    bc[i] = b0 - 2 * b1 + b2;
    dd[i] = d2 - d0;
  }
}

// The rows of the ten components at one (y, z), computed from the sums. Entry i of the output is at sample 2i
// + 1 of the sums, which start one sample before the box.
template <class Sum>
inline __attribute__((always_inline)) void finish_row(const RowSums<Sum>& sums, std::int64_t n, float scale,
                                                      const std::array<float*, 10>& out) {
  const float first = scale / 72, second = scale / 36, mixed = scale / 24;
  const Sum* __restrict bb = sums.bb.data();
  const Sum* __restrict db = sums.db.data();
  const Sum* __restrict bd = sums.bd.data();
  const Sum* __restrict cb = sums.cb.data();
  const Sum* __restrict bc = sums.bc.data();
  const Sum* __restrict dd = sums.dd.data();
  float* __restrict o[10];
  for (std::size_t c = 0; c < 10; ++c) o[c] = out[c];
  TAGRID_INDEPENDENT
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int64_t l = 2 * i, m = l + 1, r = l + 2;
    const Sum ends = bb[l] + bb[r];
    o[CurvatureField::value][i] = static_cast<float>(ends + 4 * bb[m]);
    o[CurvatureField::gx][i] = static_cast<float>(bb[r] - bb[l]) * first;
    o[CurvatureField::hxx][i] = static_cast<float>(ends - 2 * bb[m]) * second;
    o[CurvatureField::gy][i] = static_cast<float>(db[l] + 4 * db[m] + db[r]) * first;
    o[CurvatureField::gz][i] = static_cast<float>(bd[l] + 4 * bd[m] + bd[r]) * first;
    o[CurvatureField::hyy][i] = static_cast<float>(cb[l] + 4 * cb[m] + cb[r]) * second;
    o[CurvatureField::hzz][i] = static_cast<float>(bc[l] + 4 * bc[m] + bc[r]) * second;
    o[CurvatureField::hxy][i] = static_cast<float>(db[r] - db[l]) * mixed;
    o[CurvatureField::hxz][i] = static_cast<float>(bd[r] - bd[l]) * mixed;
    o[CurvatureField::hyz][i] = static_cast<float>(dd[l] + 4 * dd[m] + dd[r]) * mixed;
  }
}

// Floats as integers in the same order. Vector code finds the largest and smallest of integers, but not of
// floats. NaNs lie beyond infinity.
TAGRID_INLINE std::int32_t ordered(float v) {
  const auto bits = std::bit_cast<std::int32_t>(v);
  return bits ^ ((bits >> 31) & 0x7fffffff);
}
TAGRID_INLINE float from_ordered(std::int32_t order) {
  return std::bit_cast<float>(order ^ ((order >> 31) & 0x7fffffff));
}

inline __attribute__((always_inline)) CurvatureField::RowBounds bounds_of_row(
    const std::array<float*, 10>& row, std::int64_t n) {
  using Field = CurvatureField;
  constexpr std::int32_t least = std::numeric_limits<std::int32_t>::min(),
                         most = std::numeric_limits<std::int32_t>::max();
  std::int32_t lowest = most, highest = least;
  std::uint32_t slope = 0, bend = 0;  // a NaN counts as the largest, whatever its sign
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int32_t value = ordered(row[Field::value][i]);
    lowest = value < lowest ? value : lowest;
    highest = value > highest ? value : highest;
    const float gx = row[Field::gx][i], gy = row[Field::gy][i], gz = row[Field::gz][i];
    const float hxx = row[Field::hxx][i], hyy = row[Field::hyy][i], hzz = row[Field::hzz][i];
    const float hxy = row[Field::hxy][i], hxz = row[Field::hxz][i], hyz = row[Field::hyz][i];
    const auto g = std::bit_cast<std::uint32_t>(gx * gx + gy * gy + gz * gz);
    const auto h = std::bit_cast<std::uint32_t>((hxx * hxx + hyy * hyy + hzz * hzz) +
                                                2.0F * (hxy * hxy + hxz * hxz + hyz * hyz));
    slope = g > slope ? g : slope;
    bend = h > bend ? h : bend;
  }
  return {from_ordered(lowest), from_ordered(highest), std::sqrt(std::bit_cast<float>(slope)),
          std::sqrt(std::bit_cast<float>(bend))};
}

}  // namespace

template <class T>
TAGRID_VECTOR_CODE void evaluate_curvature(const Samples<T>& samples, const Box& box, double field_scale,
                                           CurvatureField& out) {
  assert(samples.box.contains(box.grown(CurvatureField::halo)));
  out.box = box;
  out.size = {(box.size().x + 1) / 2, (box.size().y + 1) / 2, (box.size().z + 1) / 2};
  for (auto& component : out.components)
    component = std::make_unique_for_overwrite<float[]>(
        static_cast<std::size_t>(out.size.x * out.size.y * out.size.z));

  const std::int64_t width = box.size().x + 2;
  const auto scale = static_cast<float>(field_scale);
  RowSums<std::conditional_t<std::is_floating_point_v<T>, double, std::int32_t>> sums;
  sums.resize(static_cast<std::size_t>(width));
  std::array<float*, 10> target;
  out.rows.clear();
  out.rows.reserve(static_cast<std::size_t>(out.size.y * out.size.z));
  std::size_t position = 0;
  for (std::int64_t z = box.low.z; z <= box.high.z; z += 2)
    for (std::int64_t y = box.low.y; y <= box.high.y; y += 2) {
      NineRows<T> rows;
      for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy)
          rows.at[static_cast<std::size_t>(3 * (dz + 1) + dy + 1)] =
              samples.row(y + dy, z + dz) + (box.low.x - 1 - samples.box.low.x);
      sum_rows(rows, width, sums);
      for (std::size_t c = 0; c < 10; ++c) target[c] = out.components[c].get() + position;
      finish_row(sums, out.size.x, scale, target);
      out.rows.push_back(bounds_of_row(target, out.size.x));
      position += static_cast<std::size_t>(out.size.x);
    }
}

#define TAGRID_INSTANTIATE(T) \
  template void evaluate_curvature(const Samples<T>&, const Box&, double, CurvatureField&);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
TAGRID_INSTANTIATE(double)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
