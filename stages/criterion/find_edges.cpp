#include "stages/criterion/find_edges.h"

#include <cassert>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/criterion/find_edges.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "stages/sample/instruction_sets.h"

#ifndef TAGRID_STAGES_CRITERION_ENDS_OF_ROW
#define TAGRID_STAGES_CRITERION_ENDS_OF_ROW
namespace tagrid {

// The edges of points of a slice. Index 1 is for every second column, as diagonals alternate along x: the
// ends of cell i are entries left[i % 2] + i and right[i % 2] + i of the components.
struct EndsOfRow {
  std::array<std::int64_t, 2> left, right;
  std::array<float, 2> second,
      third;  // 1 or -1: whether a diagonal rises along its second and its third axis
};

struct EndsOfSlice {
  PointsOfSlice points;
  PointNumbers numbers;
  std::array<const float*, CurvatureField::component_count> components;  // those that the direction needs
  std::array<EndsOfRow, 2> rows;  // the first and the second row; those after them alternate, too
  std::int64_t stride;            // entries from row to row
  float rise_scale;
};

// 0, 1, 2 and so on. Loaded, as Iota() of Highway 1.0 stores the numbers one by one, and a processor waits for
// all of them to load them together.
alignas(64) inline constexpr std::array<std::uint32_t, EdgeBatch::padding> counted = [] {
  std::array<std::uint32_t, EdgeBatch::padding> numbers{};
  for (std::uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
  return numbers;
}();

}  // namespace tagrid
#endif

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, EdgeBatch::padding>;
using Numbers = hn::Rebind<std::uint32_t, Floats>;
using Float = hn::Vec<Floats>;
using Number = hn::Vec<Numbers>;
using Which = hn::Mask<Floats>;

// The work on a batch of edges is inlined into the loop over a row, except under sanitizers, where it would
// only bloat the code.
#undef TAGRID_EDGES
#ifdef TAGRID_SMALL_CODE
#define TAGRID_EDGES HWY_NOINLINE
#else
#define TAGRID_EDGES HWY_INLINE
#endif

HWY_INLINE Float set(float value) { return hn::Set(Floats(), value); }

// The values of edges, as in EdgeBatch.
struct Edges {
  Float rise, slope_left, slope_right, bend_left, bend_right;
};

// Slope and second derivative along the edges at the ends of one side. `entry(c)` is component c of the
// direction.
struct End {
  Float slope, bend;
};

template <int odd, class Entry>
HWY_INLINE End end_of(const Entry& entry, Float s, Float t) {
  if constexpr (odd == 1) {
    return {entry(1), entry(2)};
  } else if constexpr (odd == 2) {
    const Float slope = hn::Add(entry(1), hn::Mul(s, entry(2)));
    const Float mixed = hn::Mul(set(2.0F), hn::Mul(s, entry(5)));
    return {hn::Mul(slope, set(0.70710678F)),
            hn::Mul(hn::Add(hn::Add(entry(3), entry(4)), mixed), set(0.5F))};
  } else {
    const Float slope = hn::Add(hn::Add(entry(1), hn::Mul(s, entry(2))), hn::Mul(t, entry(3)));
    const Float mixed =
        hn::Add(hn::Add(hn::Mul(s, entry(7)), hn::Mul(t, entry(8))), hn::Mul(hn::Mul(s, t), entry(9)));
    const Float pure = hn::Add(hn::Add(entry(4), entry(5)), entry(6));
    return {hn::Mul(slope, set(0.57735027F)),
            hn::Mul(hn::Add(pure, hn::Mul(set(2.0F), mixed)), set(1.0F / 3))};
  }
}

// The edges from entry `i` on.
template <int odd, bool alternate>
TAGRID_EDGES Edges load(const EndsOfSlice& slice, const EndsOfRow& ends, std::int64_t i, Which every_second,
                        Float s, Float t) {
  const auto entry = [&](std::size_t component, const std::array<std::int64_t, 2>& at) HWY_ATTR {
    const float* from = slice.components[component] + i;
    const Float value = hn::LoadU(Floats(), from + at[0]);
    if constexpr (!alternate) return value;
    return hn::IfThenElse(every_second, hn::LoadU(Floats(), from + at[1]), value);
  };
  const auto left = [&](std::size_t component) HWY_ATTR { return entry(component, ends.left); };
  const auto right = [&](std::size_t component) HWY_ATTR { return entry(component, ends.right); };
  const End l = end_of<odd>(left, s, t), r = end_of<odd>(right, s, t);
  return {hn::Mul(hn::Sub(right(0), left(0)), set(slice.rise_scale)), l.slope, r.slope, l.bend, r.bend};
}

// This test only selects edges to measure. So products may be fused with sums, and a NaN may be selected or not.
class Bent {
 public:
  Bent(const BentTest& test, const PointsOfSlice& points)
      : limit_(set(test.limit)),
        inverse_(set(1.0F / points.length())),
        sixth_(set(BentTest::sixth(points))) {}

  TAGRID_EDGES Which operator()(const Edges& e) const {
    const Float chord = hn::Mul(e.rise, inverse_), stretch = hn::MulAdd(chord, chord, set(1.0F));
    const Angles l = angles(e.slope_left, e.bend_left, chord),
                 r = angles(e.slope_right, hn::Neg(e.bend_right), chord);
    // |sum| + sum of sizes: twice the larger of the sum of the positive terms and that of the negative ones.
    const Float sum = hn::Add(hn::Add(l.tangent, l.half_step), hn::Add(r.tangent, r.half_step)),
                sizes = hn::Add(hn::Add(hn::Abs(l.tangent), hn::Abs(l.half_step)),
                                hn::Add(hn::Abs(r.tangent), hn::Abs(r.half_step))),
                beside = hn::Add(hn::Abs(sum), sizes);
    const Float squares = hn::MulAdd(hn::Mul(beside, beside), set(0.25F), hn::Add(of_end(l), of_end(r)));
    return hn::Or(hn::Gt(squares, hn::Mul(limit_, hn::Mul(stretch, stretch))),
                  hn::Gt(hn::Max(l.difference, r.difference), set(0.5F)));
  }

 private:
  // Times 1 + c^2.
  struct Angles {
    Float difference, tangent, half_step;
  };
  HWY_INLINE Angles angles(Float slope, Float bend, Float chord) const {
    const Float difference = hn::Sub(slope, chord), e = hn::Abs(difference), one = set(1.0F);
    return {e, hn::Mul(difference, hn::MulAdd(set(0.75F), e, one)),
            hn::Mul(hn::Mul(sixth_, bend), hn::MulAdd(set(4.75F), e, one))};
  }
  // a^2 + b^2 + 4/3 ab, or without the product if that is negative.
  HWY_INLINE Float of_end(const Angles& of) const {
    const Float product = hn::Max(hn::Mul(of.tangent, of.half_step), hn::Zero(Floats()));
    return hn::MulAdd(of.tangent, of.tangent,
                      hn::MulAdd(of.half_step, of.half_step, hn::Mul(product, set(4.0F / 3))));
  }
  Float limit_, inverse_, sixth_;
};

// The weights are 720 times the integrals of the products of quadratic B-splines over the three segments, in
// terms of sums and differences of the two ends; sums and differences do not mix. No operation may be
// reordered.
class Varied {
 public:
  Varied(const VarianceTest& test, const PointsOfSlice& points)
      : limit_(set(test.limit)), sixth_(set(VarianceTest::sixth(points))) {
    constexpr float inverse_sqrt[4] = {0, 1, 0.70710678F, 0.57735027F};
    inverse_length_ = set(inverse_sqrt[points.odd] * (0.5F / static_cast<float>(points.unit)));
  }

  TAGRID_EDGES Which operator()(const Edges& e) const {
    const Float chord = hn::Mul(e.rise, inverse_length_);
    const Float stretch = hn::Add(set(1.0F), hn::Mul(chord, chord));
    const Float left = hn::Sub(e.slope_left, chord), right = hn::Sub(e.slope_right, chord);
    const Float bend_left = hn::Mul(sixth_, e.bend_left), bend_right = hn::Mul(sixth_, e.bend_right);
    const Float p = hn::Sub(left, right), s = hn::Add(left, right);
    const Float a = hn::Sub(bend_right, bend_left), b = hn::Add(bend_left, bend_right);
    const Float even = hn::Add(hn::Mul(p, hn::Add(hn::Mul(set(91.0F), p), hn::Mul(set(106.0F), b))),
                               hn::Mul(set(39.0F), hn::Mul(b, b)));
    const Float odd = hn::Add(hn::Mul(s, hn::Sub(hn::Mul(set(117.0F), s), hn::Mul(set(166.0F), a))),
                              hn::Mul(set(73.0F), hn::Mul(a, a)));
    return hn::Gt(hn::Add(even, odd), hn::Mul(limit_, hn::Mul(stretch, stretch)));
  }

 private:
  Float limit_, inverse_length_, sixth_;
};

// One row, from a column on; returns the first column that was not looked at.
template <int odd, bool alternate, class Test>
HWY_INLINE std::int64_t find_in_row(const EndsOfSlice& slice, const Test& is_found, EdgePlace from,
                                    FoundEdges& found) {
  const PointsOfSlice& points = slice.points;
  const Floats d;
  const Numbers number;
  const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
  const EndsOfRow& ends = slice.rows[static_cast<std::size_t>(from.row & 1)];
  const std::int64_t start = (from.row & ~std::int64_t{1}) * slice.stride;
  const Number step = hn::Set(number, static_cast<std::uint32_t>(2 * points.unit)),
               first_point = hn::Set(
                   number, slice.numbers.first + slice.numbers.row * static_cast<std::uint32_t>(from.row)),
               first_columns = hn::Load(number, counted.data());
  const Float length = set(points.length());
  std::size_t count = found.count;
  std::int64_t i = from.column;
  for (; i < points.columns && count + EdgeBatch::padding <= EdgeBatch::capacity; i += lanes) {
    const Number column = hn::Add(first_columns, hn::Set(number, static_cast<std::uint32_t>(i)));
    const Which every_second = hn::RebindMask(d, hn::TestBit(column, hn::Set(number, 1)));
    const auto sign = [&](const std::array<float, 2>& of) HWY_ATTR {
      if constexpr (!alternate) return set(of[0]);
      return hn::IfThenElse(every_second, set(of[1]), set(of[0]));
    };
    const Edges e =
        load<odd, alternate>(slice, ends, start + i, every_second, sign(ends.second), sign(ends.third));
    Which which = is_found(e);
    if (points.columns - i < lanes)
      which = hn::And(which, hn::FirstN(d, static_cast<std::size_t>(points.columns - i)));
    if (hn::AllFalse(d, which)) continue;
    const auto append = [&](Float values, EdgeBatch::Lane& to)
                            HWY_ATTR { hn::StoreU(hn::Compress(values, which), d, to.data() + count); };
    append(e.rise, found.edges.rise);
    append(e.slope_left, found.edges.slope_left);
    append(e.slope_right, found.edges.slope_right);
    append(e.bend_left, found.edges.bend_left);
    append(e.bend_right, found.edges.bend_right);
    hn::StoreU(length, d, found.edges.length.data() + count);
    const Number numbers = hn::Add(first_point, hn::Mul(column, step));
    hn::StoreU(hn::Compress(numbers, hn::RebindMask(number, which)), number, found.points.data() + count);
    count += hn::CountTrue(d, which);
  }
  found.count = count;
  return i;
}

template <int odd, bool alternate, class Test>
HWY_INLINE bool find(const EndsOfSlice& slice, const Test& is_found, EdgePlace& from, FoundEdges& found) {
  for (; from.row < slice.points.rows; ++from.row, from.column = 0) {
    from.column = find_in_row<odd, alternate>(slice, is_found, from, found);
    if (from.column < slice.points.columns) return false;
  }
  return true;
}

template <class Test>
HWY_INLINE bool find_in_slice(const EndsOfSlice& slice, const Test& test, EdgePlace& from,
                              FoundEdges& found) {
  const PointsOfSlice& points = slice.points;
  if (points.odd == 1) return find<1, false>(slice, test, from, found);
  if (points.odd == 2 && !points.odd_x) return find<2, false>(slice, test, from, found);
  if (points.odd == 2) return find<2, true>(slice, test, from, found);
  return find<3, true>(slice, test, from, found);
}

bool find_bent(const EndsOfSlice& slice, const BentTest& test, EdgePlace& from, FoundEdges& found) {
  return find_in_slice(slice, Bent(test, slice.points), from, found);
}

bool find_varied(const EndsOfSlice& slice, const VarianceTest& test, EdgePlace& from, FoundEdges& found) {
  return find_in_slice(slice, Varied(test, slice.points), from, found);
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tagrid {
namespace {

using F = CurvatureField;

// The components of the field for edges of a class. Bit 0 of the number of the class is set if x is odd, bit
// 1 if y is odd, bit 2 if z is odd. The value comes first, then the derivatives.
constexpr int components_of[8][F::component_count] = {
    {},
    {F::value, F::gx, F::hxx},
    {F::value, F::gy, F::hyy},
    {F::value, F::gx, F::gy, F::hxx, F::hyy, F::hxy},
    {F::value, F::gz, F::hzz},
    {F::value, F::gx, F::gz, F::hxx, F::hzz, F::hxz},
    {F::value, F::gy, F::gz, F::hyy, F::hzz, F::hyz},
    {F::value, F::gx, F::gy, F::gz, F::hxx, F::hyy, F::hzz, F::hxy, F::hxz, F::hyz}};

EndsOfSlice ends_of(const EdgesOfSlice& edges) {
  const CurvatureField& field = edges.field;
  const PointsOfSlice& points = edges.points;
  assert(field.distance == 2 * points.unit);
  const std::int64_t u = points.unit, across = points.odd_x ? u : 0;
  const int number = int{points.odd_x} + 2 * int{points.odd_y} + 4 * int{points.odd_z};
  EndsOfSlice slice{points, edges.numbers, {}, {}, field.size.x, edges.rise_scale};
  for (std::size_t c = 0; c < F::component_count; ++c)
    slice.components[c] = field.components[static_cast<std::size_t>(components_of[number][c])];
  const std::int64_t start = (points.x0 - across - field.box.low.x) / field.distance;
  for (const std::size_t row : {0U, 1U})
    for (const std::size_t column : {0U, 1U}) {
      const Way way = way_of(points, static_cast<std::int64_t>(column), static_cast<std::int64_t>(row));
      const std::int64_t y = points.y0 + 2 * u * static_cast<std::int64_t>(row);
      EndsOfRow& ends = slice.rows[row];
      ends.left[column] = field.row_offset(y - way.y * u, points.z - way.z * u) + start;
      ends.right[column] =
          field.row_offset(y + way.y * u, points.z + way.z * u) + start + (points.odd_x ? 1 : 0);
      const auto along_y = static_cast<float>(way.y), along_z = static_cast<float>(way.z);
      ends.second[column] = points.odd == 2 && points.odd_z ? along_z : along_y;
      ends.third[column] = along_z;
    }
  return slice;
}

}  // namespace

bool find_edges(const EdgesOfSlice& edges, const BentTest& test, EdgePlace& from, FoundEdges& found) {
  return TAGRID_BEST_VERSION(find_bent)(ends_of(edges), test, from, found);
}

bool find_edges(const EdgesOfSlice& edges, const VarianceTest& test, EdgePlace& from, FoundEdges& found) {
  return TAGRID_BEST_VERSION(find_varied)(ends_of(edges), test, from, found);
}

}  // namespace tagrid
#endif
