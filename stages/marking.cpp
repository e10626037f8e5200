#include "stages/marking.h"

#include <cmath>

namespace tagrid {
namespace {

constexpr float inverse_sqrt[4] = {0, 1, 0.70710678F, 0.57735027F};
constexpr float sqrt_of[4] = {0, 1, 1.41421356F, 1.73205081F};

// The points of one row that have the same class: x = first + step * i, base edge ends at the corners of
// their cells in the 2u lattice.
struct RowOfEdges {
  std::int64_t unit;
  std::int64_t x0, y, z;  // first point of the row
  std::int64_t count;
  int odd;  // 1, 2, 3
  bool odd_x, odd_y, odd_z;
  bool alternate;  // diagonals alternate with the parity of the cell; not at the root
};

class RowMarker {
 public:
  RowMarker(const CurvatureField& field, const MarkingParameters& parameters, LatticeBits& marks)
      : field_(field),
        constants_(parameters.accuracy),
        rise_scale_(static_cast<float>(parameters.field_scale) / CurvatureField::value_divisor),
        marks_(marks) {}

  void mark(const RowOfEdges& row) {
    for (std::int64_t from = 0; from < row.count; from += capacity) {
      const std::int64_t n = std::min<std::int64_t>(capacity, row.count - from);
      load(row, from, n);
      if (!all_flat(edges_, static_cast<std::size_t>(n))) test(row, from, n);
    }
  }
  /// Decides what is still undecided. Call it after the last row.
  void finish() {
    std::array<std::uint8_t, EdgeBatch::capacity> violated;
    measure(undecided_, undecided_lengths_, undecided_count_, constants_, violated);
    for (std::size_t i = 0; i < undecided_count_; ++i)
      if (violated[i]) marks_.set(undecided_points_[i]);
    undecided_count_ = 0;
  }

 private:
  static constexpr std::int64_t capacity = EdgeBatch::capacity;

  // Edges along one axis: the derivatives of that axis.
  void load_axis(const RowOfEdges& row, std::int64_t from, std::int64_t n) {
    const int g = row.odd_x ? CurvatureField::gx : row.odd_y ? CurvatureField::gy : CurvatureField::gz;
    const int h = row.odd_x ? CurvatureField::hxx : row.odd_y ? CurvatureField::hyy : CurvatureField::hzz;
    const std::int64_t u = row.unit, yl = row.y - (row.odd_y ? u : 0), yr = row.y + (row.odd_y ? u : 0),
                       zl = row.z - (row.odd_z ? u : 0), zr = row.z + (row.odd_z ? u : 0);
    const std::int64_t start = left_index(row, from), step = u, across = row.odd_x ? u : 0;
    const float *fl = field_.row(CurvatureField::value, yl, zl) + start,
                *fr = field_.row(CurvatureField::value, yr, zr) + start + across;
    const float *gl = field_.row(g, yl, zl) + start, *gr = field_.row(g, yr, zr) + start + across;
    const float *hl = field_.row(h, yl, zl) + start, *hr = field_.row(h, yr, zr) + start + across;
    for (std::int64_t i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      edges_.rise[at] = (fr[i * step] - fl[i * step]) * rise_scale_;
      edges_.slope_left[at] = gl[i * step];
      edges_.slope_right[at] = gr[i * step];
      edges_.bend_left[at] = hl[i * step];
      edges_.bend_right[at] = hr[i * step];
    }
  }

  // Index in a row of the field of the lowest corner of the cell around point `from` of the row.
  std::int64_t left_index(const RowOfEdges& row, std::int64_t from) const {
    return (row.x0 + 2 * row.unit * from - (row.odd_x ? row.unit : 0) - field_.box.low.x) / 2;
  }

  // Derivatives along the diagonal (sx, sy, sz) at entry `i` of the rows at (y, z).
  struct End {
    float value, slope, bend;
  };
  struct FieldRows {
    const float* c[CurvatureField::component_count];
  };
  FieldRows rows_at(std::int64_t y, std::int64_t z) const {
    FieldRows rows;
    for (int c = 0; c < CurvatureField::component_count; ++c) rows.c[c] = field_.row(c, y, z);
    return rows;
  }
  template <int Odd>
  static End end_at(const FieldRows& f, std::int64_t i, float sx, float sy, float sz) {
    using F = CurvatureField;
    const float gradient = (sx * f.c[F::gx][i] + sy * f.c[F::gy][i]) + sz * f.c[F::gz][i];
    const float straight =
        ((sx * sx) * f.c[F::hxx][i] + (sy * sy) * f.c[F::hyy][i]) + (sz * sz) * f.c[F::hzz][i];
    const float mixed =
        ((sx * sy) * f.c[F::hxy][i] + (sx * sz) * f.c[F::hxz][i]) + (sy * sz) * f.c[F::hyz][i];
    return {f.c[F::value][i], gradient * inverse_sqrt[Odd], (straight + 2.0F * mixed) * (1.0F / Odd)};
  }

  // Diagonal edges. Every second cell has the other diagonal, so the row is loaded in two runs.
  template <int Odd>
  void load_diagonal(const RowOfEdges& row, std::int64_t from, std::int64_t n) {
    const std::int64_t u = row.unit;
    for (int run = 0; run < 2; ++run) {
      // Parity of the low corner of the cells of this run, an axis; even at the root.
      const std::int64_t first_x = row.x0 + 2 * u * (from + run) - (row.odd_x ? u : 0);
      auto low_parity = [&](bool odd, std::int64_t low) {
        return odd && row.alternate && (low & (2 * u)) != 0;
      };
      const bool px = low_parity(row.odd_x, first_x), py = low_parity(row.odd_y, row.y - u),
                 pz = low_parity(row.odd_z, row.z - u);
      const bool first = row.odd_x ? px : py;
      const std::int64_t sx = row.odd_x ? 1 : 0,
                         sy = !row.odd_y    ? 0
                              : py == first ? 1
                                            : -1,
                         sz = !row.odd_z    ? 0
                              : pz == first ? 1
                                            : -1;
      const FieldRows left = rows_at(row.y - sy * u, row.z - sz * u),
                      right = rows_at(row.y + sy * u, row.z + sz * u);
      const std::int64_t start = left_index(row, from), across = row.odd_x ? u : 0;
      const auto fx = static_cast<float>(sx), fy = static_cast<float>(sy), fz = static_cast<float>(sz);
      for (std::int64_t i = run; i < n; i += 2) {
        const End l = end_at<Odd>(left, start + i * u, fx, fy, fz);
        const End r = end_at<Odd>(right, start + i * u + across, fx, fy, fz);
        const auto at = static_cast<std::size_t>(i);
        edges_.rise[at] = (r.value - l.value) * rise_scale_;
        edges_.slope_left[at] = l.slope;
        edges_.slope_right[at] = r.slope;
        edges_.bend_left[at] = l.bend;
        edges_.bend_right[at] = r.bend;
      }
    }
  }

  void load(const RowOfEdges& row, std::int64_t from, std::int64_t n) {
    if (row.odd == 1) load_axis(row, from, n);
    if (row.odd == 2) load_diagonal<2>(row, from, n);
    if (row.odd == 3) load_diagonal<3>(row, from, n);
  }

  void test(const RowOfEdges& row, std::int64_t from, std::int64_t n) {
    std::array<std::uint8_t, EdgeBatch::capacity> clear;
    const float length = static_cast<float>(2 * row.unit) * sqrt_of[row.odd];
    rule_out(edges_, static_cast<std::size_t>(n), length, constants_, clear);
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      if (clear[i]) continue;
      const std::size_t to = undecided_count_++;
      undecided_.rise[to] = edges_.rise[i];
      undecided_.slope_left[to] = edges_.slope_left[i];
      undecided_.slope_right[to] = edges_.slope_right[i];
      undecided_.bend_left[to] = edges_.bend_left[i];
      undecided_.bend_right[to] = edges_.bend_right[i];
      undecided_lengths_[to] = length;
      undecided_points_[to] = {row.x0 + 2 * row.unit * (from + static_cast<std::int64_t>(i)), row.y, row.z};
      if (undecided_count_ == EdgeBatch::capacity) finish();
    }
  }

  const CurvatureField& field_;
  CriterionParameters constants_;
  float rise_scale_;
  LatticeBits& marks_;
  EdgeBatch edges_;
  EdgeBatch undecided_;
  EdgeBatch::Lane undecided_lengths_;
  std::array<Index3, EdgeBatch::capacity> undecided_points_;
  std::size_t undecided_count_ = 0;
};

// First coordinate >= low of the form unit * odd number, or unit * even number.
std::int64_t first_of(std::int64_t low, std::int64_t unit, bool odd) {
  const std::int64_t offset = odd ? unit : 0, period = 2 * unit;
  return offset + (low - offset + period - 1) / period * period;
}

}  // namespace

void mark_curvature(const CurvatureField& field, const Domain& domain, const MarkingParameters& parameters,
                    LatticeBits& marks) {
  const Box box = intersection(marks.box(), domain.volume());
  if (box.empty()) return;
  RowMarker marker(field, parameters, marks);
  int cycle = 0;
  for (std::int64_t unit = domain.cube_size / 2; unit >= 1; unit /= 2, ++cycle)
    for (int bits = 1; bits < 8; ++bits) {
      const bool ox = bits & 1, oy = bits & 2, oz = bits & 4;
      const int odd = int{ox} + int{oy} + int{oz};
      if (3 * cycle + 4 - odd > parameters.max_level) continue;
      const std::int64_t x0 = first_of(box.low.x, unit, ox), period = 2 * unit;
      if (x0 > box.high.x) continue;
      const std::int64_t count = (box.high.x - x0) / period + 1;
      for (std::int64_t z = first_of(box.low.z, unit, oz); z <= box.high.z; z += period)
        for (std::int64_t y = first_of(box.low.y, unit, oy); y <= box.high.y; y += period)
          marker.mark({unit, x0, y, z, count, odd, ox, oy, oz, period != domain.cube_size});
    }
  marker.finish();
}

}  // namespace tagrid
