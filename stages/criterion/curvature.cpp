#include "stages/criterion/curvature.h"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <type_traits>

#include "stages/sample/sample_type.h"
#include "stages/sample/vector_code.h"

namespace tagrid {
namespace {

// Sums over the 3x3 rows around a row, each with a stencil in y and one in z: b = (1,4,1), d = (-1,0,1), c =
// (1,-2,1). They are exact: in 32 bits for integers of up to 16 bits, in 53 bits for heights.
template <class Sum>
struct RowSums {
  std::unique_ptr<Sum[]> all;
  Sum *bb, *db, *bd, *cb, *bc, *dd;

  explicit RowSums(std::size_t n) : all(std::make_unique_for_overwrite<Sum[]>(6 * n)) {
    Sum* next = all.get();
    for (Sum** sums : {&bb, &db, &bd, &cb, &bc, &dd}) {
      *sums = next;
      next += n;
    }
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
  Sum* __restrict bb = sums.bb;
  Sum* __restrict db = sums.db;
  Sum* __restrict bd = sums.bd;
  Sum* __restrict cb = sums.cb;
  Sum* __restrict bc = sums.bc;
  Sum* __restrict dd = sums.dd;
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
  const Sum* __restrict bb = sums.bb;
  const Sum* __restrict db = sums.db;
  const Sum* __restrict bd = sums.bd;
  const Sum* __restrict cb = sums.cb;
  const Sum* __restrict bc = sums.bc;
  const Sum* __restrict dd = sums.dd;
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

}  // namespace

CurvatureField::CurvatureField(const Box& points, std::int64_t distance_of_points, std::int64_t kept_slices)
    : box(points), distance(distance_of_points), slices(kept_slices) {
  for (int axis = 0; axis < 3; ++axis) size[axis] = (box.size()[axis] - 1) / distance + 1;
  const auto count = static_cast<std::size_t>(slices * size.y * size.x);
  all_ = std::make_unique_for_overwrite<float[]>(component_count * (count + padding));
  float* next = all_.get();
  for (float*& component : components) {
    component = next;
    next = std::fill_n(component + count, padding, 0.0F);
  }
}

template <class T>
TAGRID_VECTOR_CODE void evaluate_curvature(const Samples<T>& samples, std::int64_t z, double field_scale,
                                           CurvatureField& field) {
  const Box& box = field.box;
  assert(field.distance == 2 && samples.box.contains(box.grown(CurvatureField::halo)));
  const std::int64_t width = box.size().x + 2;
  const auto scale = static_cast<float>(field_scale);
  RowSums<std::conditional_t<std::is_floating_point_v<T>, double, std::int32_t>> sums(
      static_cast<std::size_t>(width));
  for (std::int64_t y = box.low.y; y <= box.high.y; y += 2) {
    NineRows<T> rows;
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        rows.at[static_cast<std::size_t>(3 * (dz + 1) + dy + 1)] =
            samples.row(y + dy, z + dz) + (box.low.x - 1 - samples.box.low.x);
    sum_rows(rows, width, sums);
    std::array<float*, 10> target;
    for (std::size_t c = 0; c < 10; ++c) target[c] = field.components[c] + field.row_offset(y, z);
    finish_row(sums, field.size.x, scale, target);
  }
}

void thin_out(const CurvatureField& from, std::int64_t z, CurvatureField& to) {
  assert(to.distance == 2 * from.distance && to.box == from.box);
  for (std::size_t c = 0; c < from.components.size(); ++c)
    for (std::int64_t y = to.box.low.y; y <= to.box.high.y; y += to.distance) {
      const float* source = from.components[c] + from.row_offset(y, z);
      float* target = to.components[c] + to.row_offset(y, z);
      for (std::int64_t x = 0; x < to.size.x; ++x) target[x] = source[2 * x];
    }
}

#define TAGRID_INSTANTIATE(T) \
  template void evaluate_curvature(const Samples<T>&, std::int64_t, double, CurvatureField&);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
TAGRID_INSTANTIATE(double)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
