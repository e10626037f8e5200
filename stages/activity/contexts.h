// The contexts in which the activity of points is coded: what is known around them. They are found for 64
// points of a row at a time, with one word for each bit of a context. Only whether the point before in the
// same row is active is not known until it is coded.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/activity/candidates.h"
#include "stages/activity/forecast.h"
#include "stages/activity/neighbour_words.h"
#include "stages/activity/surprises.h"
#include "stages/activity/surroundings.h"
#include "stages/entropy/adaptive_bit.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

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
