#include "stages/marks/base_edges.h"

#include <cmath>

#include "stages/volume/vector_code.h"

namespace tagrid {
namespace {

using F = CurvatureField;

// One run of edges in a row. Their ends are every `step`-th entry of rows of the field: the value comes
// first, then the derivatives that the direction needs.
struct Run {
  const float* components[F::component_count];
  std::int64_t left, right;  // positions of the first edge's ends in those rows
  std::int64_t step, count;
  float rise_scale;
};

// Whether a diagonal rises (1) or falls (-1) along its second and its third axis. It rises along the first.
struct Signs {
  float s, t;
};

// The ends on one side of the edges of a run: value, slope and bend as functions of the edge. The pointers
// are separate members, as the compiler keeps arrays of them in memory and then does not vectorize.
struct EndsAlongAxis {
  const float *value, *g, *h;

  TAGRID_INLINE EndsAlongAxis(const float* const* c, std::int64_t at)
      : value(c[0] + at), g(c[1] + at), h(c[2] + at) {}
  TAGRID_INLINE float slope(std::int64_t i, Signs) const { return g[i]; }
  TAGRID_INLINE float bend(std::int64_t i, Signs) const { return h[i]; }
};

// Along the diagonal of a face; the sign of its second axis is s.
struct EndsAlongFace {
  const float *value, *ga, *gb, *haa, *hbb, *hab;

  TAGRID_INLINE EndsAlongFace(const float* const* c, std::int64_t at)
      : value(c[0] + at), ga(c[1] + at), gb(c[2] + at), haa(c[3] + at), hbb(c[4] + at), hab(c[5] + at) {}
  TAGRID_INLINE float slope(std::int64_t i, Signs sign) const {
    return (ga[i] + sign.s * gb[i]) * 0.70710678F;
  }
  TAGRID_INLINE float bend(std::int64_t i, Signs sign) const {
    return ((haa[i] + hbb[i]) + 2.0F * (sign.s * hab[i])) * 0.5F;
  }
};

// Along the space diagonal (1, s, t).
struct EndsAlongSpace {
  const float *value, *gx, *gy, *gz, *hxx, *hyy, *hzz, *hxy, *hxz, *hyz;

  TAGRID_INLINE EndsAlongSpace(const float* const* c, std::int64_t at)
      : value(c[0] + at),
        gx(c[1] + at),
        gy(c[2] + at),
        gz(c[3] + at),
        hxx(c[4] + at),
        hyy(c[5] + at),
        hzz(c[6] + at),
        hxy(c[7] + at),
        hxz(c[8] + at),
        hyz(c[9] + at) {}
  TAGRID_INLINE float slope(std::int64_t i, Signs sign) const {
    return ((gx[i] + sign.s * gy[i]) + sign.t * gz[i]) * 0.57735027F;
  }
  TAGRID_INLINE float bend(std::int64_t i, Signs sign) const {
    return (((hxx[i] + hyy[i]) + hzz[i]) +
            2.0F * ((sign.s * hxy[i] + sign.t * hxz[i]) + (sign.s * sign.t) * hyz[i])) *
           (1.0F / 3);
  }
};

// The components of the field for edges of a class. Bit 0 of the number of the class is set if x is odd, bit
// 1 if y is odd, bit 2 if z is odd.
constexpr int components_of[8][F::component_count] = {
    {},
    {F::value, F::gx, F::hxx},
    {F::value, F::gy, F::hyy},
    {F::value, F::gx, F::gy, F::hxx, F::hyy, F::hxy},
    {F::value, F::gz, F::hzz},
    {F::value, F::gx, F::gz, F::hxx, F::hzz, F::hxz},
    {F::value, F::gy, F::gz, F::hyy, F::hzz, F::hyz},
    {F::value, F::gx, F::gy, F::gz, F::hxx, F::hyy, F::hzz, F::hxy, F::hxz, F::hyz}};

template <class Ends>
TAGRID_INLINE void load_steps(const Run& run, std::int64_t step, Signs sign, EdgeBatch& edges,
                              std::size_t lane) {
  float* __restrict rise = edges.rise.data() + lane;
  float* __restrict slope_left = edges.slope_left.data() + lane;
  float* __restrict slope_right = edges.slope_right.data() + lane;
  float* __restrict bend_left = edges.bend_left.data() + lane;
  float* __restrict bend_right = edges.bend_right.data() + lane;
  const std::int64_t count = run.count;
  const float rise_scale = run.rise_scale;
  const Ends left(run.components, run.left), right(run.components, run.right);
  TAGRID_INDEPENDENT
  for (std::int64_t i = 0; i < count; ++i) {
    rise[i] = (right.value[i * step] - left.value[i * step]) * rise_scale;
    slope_left[i] = left.slope(i * step, sign);
    slope_right[i] = right.slope(i * step, sign);
    bend_left[i] = left.bend(i * step, sign);
    bend_right[i] = right.bend(i * step, sign);
  }
}

// The compiler knows the steps at the finest level, where almost all edges are.
template <class Ends>
TAGRID_INLINE void load_run(const Run& run, Signs sign, EdgeBatch& edges, std::size_t lane) {
  if (run.step == 1)
    load_steps<Ends>(run, 1, sign, edges, lane);
  else if (run.step == 2)
    load_steps<Ends>(run, 2, sign, edges, lane);
  else
    load_steps<Ends>(run, run.step, sign, edges, lane);
}

}  // namespace

namespace base_edges {

TAGRID_VECTOR_CODE
void load_axis(const Run& run, Signs sign, EdgeBatch& edges, std::size_t lane) {
  load_run<EndsAlongAxis>(run, sign, edges, lane);
}

TAGRID_VECTOR_CODE
void load_face(const Run& run, Signs sign, EdgeBatch& edges, std::size_t lane) {
  load_run<EndsAlongFace>(run, sign, edges, lane);
}

TAGRID_VECTOR_CODE
void load_space(const Run& run, Signs sign, EdgeBatch& edges, std::size_t lane) {
  load_run<EndsAlongSpace>(run, sign, edges, lane);
}

}  // namespace base_edges

namespace {

// The direction of the edges of a run: the distance in units along each axis.
struct Way {
  std::int64_t x, y, z;
};

// An edge rises along its first odd axis. Along the others it rises if its cell has the same parity there;
// the low corner of the cell is at `first_x`, one unit below the row.
Way way_of(const RowOfEdges& row, std::int64_t first_x) {
  const auto parity = [&](bool odd, std::int64_t low) {
    return odd && row.alternate && (low & (2 * row.unit)) != 0;
  };
  const bool px = parity(row.odd_x, first_x), py = parity(row.odd_y, row.y - row.unit),
             pz = parity(row.odd_z, row.z - row.unit);
  const bool first = row.odd_x ? px : row.odd_y ? py : pz;
  const auto along = [&](bool odd, bool p) { return !odd ? 0 : p == first ? 1 : -1; };
  return {along(row.odd_x, px), along(row.odd_y, py), along(row.odd_z, pz)};
}

}  // namespace

void load_edges(const CurvatureField& field, const RowOfEdges& row, std::int64_t from, std::int64_t count,
                float rise_scale, EdgeBatch& edges, std::size_t lane) {
  const std::int64_t u = row.unit, across = row.odd_x ? u : 0;
  const int runs = row.runs(), number = int{row.odd_x} + 2 * int{row.odd_y} + 4 * int{row.odd_z};
  for (int first = 0; first < runs; ++first) {
    const std::int64_t low_x = row.x0 + 2 * u * (from + first) - across;
    const Way way = way_of(row, low_x);
    Run run;
    run.step = u * runs;
    run.count = (count - first + runs - 1) / runs;
    run.rise_scale = rise_scale;
    for (std::size_t c = 0; c < F::component_count; ++c)
      run.components[c] = field.components[static_cast<std::size_t>(components_of[number][c])].get();
    const std::int64_t start = (low_x - field.box.low.x) / 2;
    run.left = field.row_offset(row.y - way.y * u, row.z - way.z * u) + start;
    run.right = field.row_offset(row.y + way.y * u, row.z + way.z * u) + start + across;

    const auto y = static_cast<float>(way.y), z = static_cast<float>(way.z);
    if (row.odd == 1)
      base_edges::load_axis(run, {}, edges, lane);
    else if (row.odd == 2)
      base_edges::load_face(run, {row.odd_z ? z : y, 0}, edges, lane);
    else
      base_edges::load_space(run, {y, z}, edges, lane);
    lane += static_cast<std::size_t>(run.count);
  }
}

EdgeBounds bounds_of(const CurvatureField& field, const RowOfEdges& row, float rise_scale) {
  // The ends of all edges of a row are in one or two rows.
  const Way way = way_of(row, row.x0 - (row.odd_x ? row.unit : 0));
  const std::int64_t dy = way.y * row.unit, dz = way.z * row.unit;
  constexpr float inverse_sqrt[4] = {0, 1, 0.70710678F, 0.57735027F}, rounding = 1.0001F;
  // NaNs must not be lost, as they would be in a comparison.
  const auto larger = [](float a, float b) { return a > b || std::isnan(a) ? a : b; };
  const F::RowBounds& l = field.rows[static_cast<std::size_t>(field.row_number(row.y - dy, row.z - dz))];
  const F::RowBounds& r = field.rows[static_cast<std::size_t>(field.row_number(row.y + dy, row.z + dz))];
  const float rise = larger(l.highest, r.highest) + larger(-l.lowest, -r.lowest);
  const float length = static_cast<float>(2 * row.unit);
  return {rounding * larger(l.slope, r.slope),
          rounding * (rise * rise_scale) * (inverse_sqrt[row.odd] / length),
          rounding * larger(l.bend, r.bend)};
}

}  // namespace tagrid
