#include "stages/marks/marking.h"

#include <algorithm>
#include <span>

#include "stages/marks/base_edges.h"
#include "stages/marks/variance.h"

namespace tagrid {
namespace {

float length_of(const RowOfEdges& row) {
  constexpr float sqrt_of[4] = {0, 1, 1.41421356F, 1.73205081F};
  return static_cast<float>(2 * row.unit) * sqrt_of[row.odd];
}

// Finds all edges that can violate the criterion.
struct BentTest {
  CriterionParameters constants;

  // True if find() would find none among edges within these bounds; see find_bent().
  bool none(const EdgeBounds& bounds, const RowOfEdges& row) const {
    const float half_step = length_of(row) * (1.0F + 0.5F * constants.angle) * (1.0F / 6);
    return 3.0F * (bounds.slope + bounds.chord + half_step * bounds.bend) < 0.999F * constants.angle;
  }
  bool find(const EdgeBatch& edges, std::size_t count, const RowOfEdges& row, EdgeBatch::Flags& bent) const {
    return find_bent(edges, count, length_of(row), constants, bent);
  }
};

// Only edges that the test finds are measured.
template <class Test>
class RowMarker {
 public:
  // A point is set in as many of the `sets` as its edge exceeds thresholds.
  RowMarker(const CurvatureField& field, const MarkingParameters& parameters,
            const CriterionParameters& constants, const Test& test, std::span<LatticeBits> sets)
      : field_(field),
        constants_(constants),
        test_(test),
        rise_scale_(static_cast<float>(parameters.field_scale) / CurvatureField::value_divisor),
        sets_(sets) {}

  void mark(const RowOfEdges& row) {
    if (test_.none(bounds_of(field_, row, rise_scale_), row)) return;
    if (row.unit != class_.unit || row.odd != class_.odd) {
      test();
      class_ = row;
    }
    for (std::int64_t from = 0; from < row.count;) {
      if (loaded_ == capacity) test();
      const std::int64_t n = std::min(row.count - from, static_cast<std::int64_t>(capacity - loaded_));
      load(row, from, n);
      from += n;
    }
  }
  /// Decides about the edges that are left. Call it after the last row.
  void finish() {
    test();
    settle();
  }

 private:
  static constexpr std::size_t capacity = EdgeBatch::capacity;
  using Bits = std::array<std::size_t, capacity>;

  void load(const RowOfEdges& row, std::int64_t from, std::int64_t n) {
    load_edges(field_, row, from, n, rise_scale_, edges_, loaded_);
    // In the order of the runs.
    const auto runs = static_cast<std::size_t>(row.runs()), step = static_cast<std::size_t>(2 * row.unit),
               count = static_cast<std::size_t>(n), origin = sets_[0].bit_of(row.point(from));
    for (std::size_t first = 0; first < runs; ++first)
      for (std::size_t cell = first; cell < count; cell += runs) bits_[loaded_++] = origin + step * cell;
  }

  // Finds the edges that have to be measured among those that are loaded.
  void test() {
    EdgeBatch::Flags found;
    if (loaded_ > 0 && test_.find(edges_, loaded_, class_, found)) keep(found);
    loaded_ = 0;
  }

  void keep(const EdgeBatch::Flags& found) {
    Lanes lanes;
    const std::size_t count = list(found, loaded_, 0, lanes);
    const float length = length_of(class_);
    for (std::size_t done = 0; done < count;) {
      const std::size_t room = std::min(count - done, capacity - kept_);
      const auto copy = [&](const auto& source, auto& target) {
        for (std::size_t i = 0; i < room; ++i) target[kept_ + i] = source[lanes[done + i]];
      };
      copy(edges_.rise, kept_edges_.rise);
      copy(edges_.slope_left, kept_edges_.slope_left);
      copy(edges_.slope_right, kept_edges_.slope_right);
      copy(edges_.bend_left, kept_edges_.bend_left);
      copy(edges_.bend_right, kept_edges_.bend_right);
      copy(bits_, kept_bits_);
      for (std::size_t i = 0; i < room; ++i) kept_lengths_[kept_ + i] = length;
      kept_ += room, done += room;
      if (kept_ == capacity) settle();
    }
  }

  // Lists the lanes whose flag is above `limit`; returns their number. Without a branch for each lane: it could
  // not be predicted.
  using Lanes = std::array<std::uint8_t, EdgeBatch::capacity>;
  static std::size_t list(const EdgeBatch::Flags& flags, std::size_t count, std::uint8_t limit,
                          Lanes& lanes) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < count; ++i) {
      lanes[found] = static_cast<std::uint8_t>(i);
      found += flags[i] > limit;
    }
    return found;
  }

  void settle() {
    EdgeBatch::Flags exceeded;
    measure(kept_edges_, kept_lengths_, kept_, constants_, exceeded);
    for (std::uint8_t level = 0; level < sets_.size(); ++level) {
      Lanes lanes;
      const std::size_t count = list(exceeded, kept_, level, lanes);
      for (std::size_t i = 0; i < count; ++i) sets_[level].set(kept_bits_[lanes[i]]);
    }
    kept_ = 0;
  }

  const CurvatureField& field_;
  CriterionParameters constants_;
  Test test_;
  float rise_scale_;
  std::span<LatticeBits> sets_;
  // Edges of several rows of one class, and where their points have bits in the sets.
  RowOfEdges class_{};
  EdgeBatch edges_{};
  Bits bits_{};
  std::size_t loaded_ = 0;
  // Edges of any rows that have to be measured.
  EdgeBatch kept_edges_{};
  EdgeBatch::Lane kept_lengths_{};
  Bits kept_bits_{};
  std::size_t kept_ = 0;
};

template <class Test>
void mark(const CurvatureField& field, const Domain& domain, const MarkingParameters& parameters,
          const CriterionParameters& constants, const Test& test, std::span<LatticeBits> sets) {
  const Box box = intersection(sets[0].box(), domain.volume());
  if (box.empty()) return;
  RowMarker<Test> marker(field, parameters, constants, test, sets);
  for_each_row_of_edges(box, domain.cube_size, parameters.max_level,
                        [&](const RowOfEdges& row) { marker.mark(row); });
  marker.finish();
}

}  // namespace

void mark_curvature(const CurvatureField& field, const Domain& domain, const MarkingParameters& parameters,
                    LatticeBits& marks) {
  const CriterionParameters constants(parameters.accuracy);
  mark(field, domain, parameters, constants, BentTest{constants}, std::span(&marks, 1));
}

void grade_curvature(const CurvatureField& field, const Domain& domain, const MarkingParameters& parameters,
                     std::array<LatticeBits, CriterionParameters::excesses>& sets) {
  mark(field, domain, parameters, CriterionParameters(parameters.accuracy, {0.6, 1, 1.6}),
       VarianceTest(parameters.accuracy), sets);
}

}  // namespace tagrid
