// The contexts in which the activity of points is coded: what is known around them. They are found for 64
// points of a row at a time, with one word for each bit of a context. Only whether the point before in the
// same row is active is not known until it is coded.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/activity/candidates.h"
#include "stages/activity/forecast.h"
#include "stages/activity/neighbour_words.h"
#include "stages/entropy/adaptive_bit.h"
#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Points of the passes coded so far whose activity is not as forecast. There are few of them, so it pays to
/// know which rows have one.
class Surprises {
 public:
  explicit Surprises(const Box& box)
      : box_(box),
        words_(static_cast<std::size_t>(box.size().y + 63) / 64 + 2),
        rows_(words_ * static_cast<std::size_t>(box.size().z)),
        more_(box),
        less_(box) {}

  /// Adds those of a pass. `mask`: the x coordinates of the pass.
  void add(const Pass& pass, const std::vector<Word>& mask, const LatticeBits& active,
           const LatticeBits& expected) {
    for_each_row(pass, box_, [&](std::int64_t y, std::int64_t z) {
      const Word *is_active = active.row(y, z), *is_expected = expected.row(y, z);
      Word *more = more_.row(y, z), *less = less_.row(y, z), any = 0;
      for (std::size_t i = 0; i < mask.size(); ++i) {
        const Word different = (is_active[i] ^ is_expected[i]) & mask[i];
        more[i] |= different & is_active[i];
        less[i] |= different & is_expected[i];
        any |= different;
      }
      const auto row = static_cast<std::size_t>(y - box_.low.y + 64);
      rows_[static_cast<std::size_t>(z - box_.low.z) * words_ + row / 64] |= Word{any != 0} << row % 64;
    });
  }

  /// Active, but not expected to be.
  const LatticeBits& more() const { return more_; }
  /// Expected to be active, but not.
  const LatticeBits& less() const { return less_; }

  /// Bit 32 + d says whether there are any in the row at y + d, z. REQUIRES: y is in the box.
  Word rows_around(std::int64_t y, std::int64_t z) const {
    if (z < box_.low.z || z > box_.high.z) return 0;
    // Rows are counted from the second word on, so that there are 32 before the first.
    const auto first = static_cast<std::size_t>(y - box_.low.y + 32);
    const Word* slice = rows_.data() + static_cast<std::size_t>(z - box_.low.z) * words_ + first / 64;
    return first % 64 == 0 ? slice[0] : slice[0] >> first % 64 | slice[1] << (64 - first % 64);
  }

  static constexpr std::uint64_t working_bytes(Index3 size) {
    return 2 * LatticeBits::working_bytes(size) +
           static_cast<std::uint64_t>(((size.y + 63) / 64 + 2) * size.z) * sizeof(Word);
  }

 private:
  Box box_;
  std::size_t words_;  ///< of a slice in rows_
  std::vector<Word> rows_;
  LatticeBits more_, less_;
};

/// Two kinds of neighbors of the points of a pass, as steps to them. Around: points of earlier passes that
/// are not parents. A cube centre looks at the points of the coarser lattice next to its cell, a face centre
/// at the cube centres beside its two parents, an edge midpoint at the face centres of the four cells around
/// it. Beside: points of the same class but another orientation that share a parent; cube centres have none.
class Surroundings {
 public:
  /// Steps to other points; no more than there can be around a point.
  struct Steps {
    std::array<Index3, 24> steps{};
    std::size_t size = 0;

    void add(Index3 step) { steps[size++] = step; }
    std::span<const Index3> all() const { return std::span(steps).first(size); }
  };

  Surroundings() = default;
  explicit Surroundings(const Pass& pass) {
    if (pass.odd_count == 3) of_cube_centre(pass.unit);
    if (pass.odd_count == 2) of_face_centre(pass);
    if (pass.odd_count == 1) of_edge_midpoint(pass);
  }

  std::span<const Index3> around() const { return around_.all(); }
  std::span<const Index3> beside() const { return beside_.all(); }

 private:
  void of_cube_centre(std::int64_t u) {
    for (int axis = 0; axis < 3; ++axis)
      for (const std::int64_t far : {-3 * u, 3 * u})
        for (const std::int64_t da : {-u, u})
          for (const std::int64_t db : {-u, u})
            around_.add(far * unit_vector(axis) + da * unit_vector((axis + 1) % 3) +
                        db * unit_vector((axis + 2) % 3));
  }

  void of_face_centre(const Pass& pass) {
    const std::int64_t u = pass.unit;
    const int normal = !pass.odd[0] ? 0 : !pass.odd[1] ? 1 : 2;
    for (int axis = 0; axis < 3; ++axis)
      if (axis != normal)
        for (const std::int64_t side : {-u, u})
          for (const std::int64_t step : {-u, u}) {
            around_.add(side * unit_vector(normal) + 2 * step * unit_vector(axis));
            beside_.add(side * unit_vector(normal) + step * unit_vector(axis));
          }
  }

  void of_edge_midpoint(const Pass& pass) {
    const std::int64_t u = pass.unit;
    const int along = pass.odd[0] ? 0 : pass.odd[1] ? 1 : 2, a = (along + 1) % 3, b = (along + 2) % 3;
    for (const std::int64_t da : {-u, u})
      for (const std::int64_t db : {-u, u}) {
        for (const std::int64_t dl : {-u, u})
          around_.add(dl * unit_vector(along) + da * unit_vector(a) + db * unit_vector(b));
        around_.add(2 * da * unit_vector(a) + db * unit_vector(b));
        around_.add(da * unit_vector(a) + 2 * db * unit_vector(b));
        beside_.add(da * unit_vector(along) + db * unit_vector(a));
        beside_.add(da * unit_vector(along) + db * unit_vector(b));
      }
  }

  Steps around_, beside_;
};

/// The contexts of a point in each of the two models, and which weights mix them.
struct PointContext {
  std::array<std::size_t, contexts_mixed> of;
  std::size_t mixer;
};

/// The contexts of the points of a box whose activity has a forecast.
class ForecastContexts {
 public:
  static constexpr std::size_t mixers = 4;
  static constexpr std::array<std::size_t, contexts_mixed> sizes = {3 * 8 * 7 * 25, 3 * 8 * 16 * 10};
  /// New models of all contexts, those of the first kind first.
  static std::vector<AdaptiveBit> models();

  /// REQUIRES: all arguments outlive this. `active` and `candidates` may change between calls.
  ForecastContexts(const LatticeBits& active, const LatticeBits& candidates, const Forecast& forecast)
      : active_(active), candidates_(candidates), forecast_(forecast), surprises_(active.box()) {}

  void begin_pass(const Pass& pass);
  /// `mask`: the x coordinates of the pass.
  void end_pass(const std::vector<Word>& mask) {
    surprises_.add(pass_, mask, active_, forecast_.at_least(2));
  }
  /// Finds what is known around the points of word `i` in the row at y, z.
  void look(std::int64_t y, std::int64_t z, std::size_t i);
  /// The contexts of point `x` of that word. `before`: whether the candidate before it in the row is active.
  PointContext at(int x, bool before) const;

 private:
  // The surroundings in the slice z + dz.
  struct Slice {
    std::int64_t dz;
    Word rows;      ///< bit 32 + dy for the rows of these steps
    bool far_away;  ///< some row has no bit
    Surroundings::Steps beside, around;
  };

  Word at_border(std::int64_t y, std::int64_t z, std::size_t i) const;
  void look_near(std::int64_t y, std::int64_t z, std::size_t i);

  const LatticeBits& active_;
  const LatticeBits& candidates_;
  const Forecast& forecast_;
  Pass pass_{};
  std::vector<Slice> slices_;
  Surprises surprises_;
  BytesOfPoints past_, own_, near_;
  bool any_near_ = false;
};

/// The contexts of the points of a box whose activity has no forecast.
class PlainContexts {
 public:
  static constexpr std::size_t mixers = 3;
  static constexpr std::array<std::size_t, contexts_mixed> sizes = {3 * 13 * 4 * 9, 3 * 216 * 13};
  static std::vector<AdaptiveBit> models() { return std::vector<AdaptiveBit>(sizes[0] + sizes[1]); }

  PlainContexts(const LatticeBits& active, const LatticeBits& candidates, const Forecast&)
      : active_(active), candidates_(candidates) {}

  void begin_pass(const Pass& pass) { pass_ = pass, surroundings_ = Surroundings(pass); }
  void end_pass(const std::vector<Word>&) {}
  void look(std::int64_t y, std::int64_t z, std::size_t i);
  PointContext at(int x, bool before) const;

 private:
  const LatticeBits& active_;
  const LatticeBits& candidates_;
  Pass pass_{};
  Surroundings surroundings_;
  BytesOfPoints past_, around_, beside_;
};

}  // namespace tagrid
