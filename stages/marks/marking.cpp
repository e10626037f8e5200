#include "stages/marks/marking.h"

#include "stages/marks/base_edges.h"

namespace tagrid {
namespace {

constexpr float sqrt_of[4] = {0, 1, 1.41421356F, 1.73205081F};

// True if find_bent() would find no bent edge among edges within these bounds.
bool none_is_bent(const EdgeBounds& bounds, float length, const CriterionParameters& constants) {
  const float half_step = length * (1.0F + 0.5F * constants.angle) * (1.0F / 6);
  return 3.0F * (bounds.slope + bounds.chord + half_step * bounds.bend) < 0.999F * constants.angle;
}

class RowMarker {
 public:
  RowMarker(const CurvatureField& field, const MarkingParameters& parameters, LatticeBits& marks)
      : field_(field),
        constants_(parameters.accuracy),
        rise_scale_(static_cast<float>(parameters.field_scale) / CurvatureField::value_divisor),
        marks_(marks) {}

  void mark(const RowOfEdges& row) {
    if (none_is_bent(bounds_of(field_, row, rise_scale_), length_of(row), constants_)) return;
    for (std::int64_t from = 0; from < row.count; from += capacity) {
      const std::int64_t n = std::min<std::int64_t>(capacity, row.count - from);
      load_edges(field_, row, from, n, rise_scale_, edges_);
      keep_bent(row, from, n);
    }
  }
  /// Decides what is still undecided. Call it after the last row.
  void finish() {
    settle_bent();
    settle_undecided();
  }

 private:
  static constexpr std::int64_t capacity = EdgeBatch::capacity;

  // Edges of any rows that wait for a slower test until there is a whole batch of them.
  struct Waiting {
    EdgeBatch edges{};
    EdgeBatch::Lane lengths{};
    std::array<Index3, EdgeBatch::capacity> points;
    std::size_t count = 0;

    bool full() const { return count == EdgeBatch::capacity; }
    void add(const EdgeBatch& from, std::size_t i, float length, Index3 point) {
      edges.copy(from, i, count);
      lengths[count] = length;
      points[count++] = point;
    }
  };

  static float length_of(const RowOfEdges& row) {
    return static_cast<float>(2 * row.unit) * sqrt_of[row.odd];
  }

  void keep_bent(const RowOfEdges& row, std::int64_t from, std::int64_t n) {
    const float length = length_of(row);
    EdgeBatch::Flags bent;
    if (!find_bent(edges_, static_cast<std::size_t>(n), length, constants_, bent)) return;
    for (std::int64_t lane = 0; lane < n; ++lane) {
      if (!bent[static_cast<std::size_t>(lane)]) continue;
      bent_.add(edges_, static_cast<std::size_t>(lane), length, row.point(from + row.cell(lane, n)));
      if (bent_.full()) settle_bent();
    }
  }

  void settle_bent() {
    EdgeBatch::Flags clear;
    rule_out(bent_.edges, bent_.lengths, bent_.count, constants_, clear);
    for (std::size_t i = 0; i < bent_.count; ++i) {
      if (clear[i]) continue;
      undecided_.add(bent_.edges, i, bent_.lengths[i], bent_.points[i]);
      if (undecided_.full()) settle_undecided();
    }
    bent_.count = 0;
  }

  void settle_undecided() {
    EdgeBatch::Flags violated;
    measure(undecided_.edges, undecided_.lengths, undecided_.count, constants_, violated);
    for (std::size_t i = 0; i < undecided_.count; ++i)
      if (violated[i]) marks_.set(undecided_.points[i]);
    undecided_.count = 0;
  }

  const CurvatureField& field_;
  CriterionParameters constants_;
  float rise_scale_;
  LatticeBits& marks_;
  EdgeBatch edges_{};
  Waiting bent_, undecided_;
};

}  // namespace

void mark_curvature(const CurvatureField& field, const Domain& domain, const MarkingParameters& parameters,
                    LatticeBits& marks) {
  const Box box = intersection(marks.box(), domain.volume());
  if (box.empty()) return;
  RowMarker marker(field, parameters, marks);
  for_each_row_of_edges(box, domain.cube_size, parameters.max_level,
                        [&](const RowOfEdges& row) { marker.mark(row); });
  marker.finish();
}

}  // namespace tagrid
