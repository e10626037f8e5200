#include "stages/activity/coding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>

#include "stages/activity/candidates.h"
#include "stages/activity/surroundings.h"
#include "stages/entropy/mixer.h"
#include "stages/entropy/rans_coder.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

using Contexts = std::array<std::size_t, contexts_mixed>;

// Number of contexts of each kind, in one class and cycle.
constexpr Contexts sizes_alone = {832, 216, 1024, 1024}, sizes_with_forecast = {2432, 216, 1728, 1352};

// Codes the activity bits of a box in both directions: `coder` decides which.
template <class Coder>
class ActivityModel {
 public:
  ActivityModel(Coder& coder, LatticeBits& active, const Forecast& forecast, int cube_size)
      : coder_(coder),
        active_(active),
        forecast_(forecast),
        box_(active.box()),
        candidates_(active, cube_size),
        classes_(static_cast<std::size_t>(max_level(cube_size))),
        mixers_(classes_) {
    const Contexts& sizes = forecast.exists() ? sizes_with_forecast : sizes_alone;
    for (std::size_t i = 0; i < contexts_mixed; ++i) {
      first_[i] = contexts_;
      contexts_ += sizes[i];
    }
    models_.resize(classes_ * contexts_);
    const auto row = static_cast<std::int64_t>(active.words_per_row()) * 64;
    stride_ = {1, row, row * box_.size().y};
  }

  /// Returns the number of active points.
  std::int64_t code_pass(const Pass& pass, const LatticeBits* known) {
    pass_ = pass;
    found_ = 0;
    candidates_.find(pass);
    const Surroundings surroundings(active_, pass);
    const std::int64_t u = pass.unit;
    for (std::int64_t z = box_.low.z + (pass.odd[2] ? u : 0); z <= box_.high.z; z += 2 * u)
      for (std::int64_t y = box_.low.y + (pass.odd[1] ? u : 0); y <= box_.high.y; y += 2 * u)
        // Broken bytes can end long before the last point.
        if (!coder_.exhausted()) code_row(y, z, surroundings, known);
    return found_;
  }

 private:
  void code_row(std::int64_t y, std::int64_t z, const Surroundings& surroundings, const LatticeBits* known) {
    const std::uint64_t* row = candidates_.bits().row(y, z);
    for (std::size_t i = 0; i < active_.words_per_row(); ++i)
      for (std::uint64_t rest = row[i] & candidates_.mask()[i]; rest != 0; rest &= rest - 1) {
        const auto x = static_cast<std::int64_t>(64 * i) + std::countr_zero(rest);
        const Index3 p{box_.low.x + x, y, z};
        if (!code_point(p, surroundings, known != nullptr && known->test(p))) continue;
        active_.set(p);
        ++found_;
      }
  }

  bool code_point(Index3 p, const Surroundings& surroundings, bool bit) {
    const auto [around, beside] = surroundings.count_active(p);
    const Contexts contexts =
        forecast_.exists() ? contexts_with_forecast(p, around, beside) : contexts_alone(p, around, beside);
    const auto cls = static_cast<std::size_t>(pass_.cycle * 3 + pass_.odd_count - 1);
    std::array<AdaptiveBit*, contexts_mixed> models;
    for (std::size_t i = 0; i < contexts_mixed; ++i)
      models[i] = &models_[cls * contexts_ + first_[i] + contexts[i]];
    return code_mixed(coder_, bit, models, mixers_[cls], 255);
  }

  // The known facts about the two neighbours along an axis in the current pass.
  struct Along {
    std::size_t state = 0;     ///< of the point before: 0 not a candidate, 1 inactive, 2 active
    bool candidate = false;    ///< whether the point after is a candidate
    std::size_t forecast = 0;  ///< sum of both, if they are in the box
    std::size_t surprise = 0;  ///< of the point before: 0 not a candidate, 1 as forecast, 2 not
  };

  static bool is_set(std::span<const std::uint64_t> words, std::size_t bit) {
    return (words[bit / 64] >> (bit % 64)) & 1;
  }

  template <bool Forecasting>
  Along look_along(int axis, Index3 p, std::size_t bit) const {
    Along along;
    const std::int64_t d = 2 * pass_.unit;
    const auto step = static_cast<std::size_t>(d * stride_[axis]);
    const std::span<const std::uint64_t> candidates = candidates_.bits().words();
    if (p[axis] - d >= box_.low[axis]) {
      along.state = is_set(active_.words(), bit - step) ? 2 : is_set(candidates, bit - step);
      if constexpr (Forecasting) {
        const std::size_t forecast = forecast_.at(bit - step);
        along.forecast = forecast;
        if (along.state != 0) along.surprise = (along.state == 2) == (forecast >= 2) ? 1 : 2;
      }
    }
    if (p[axis] + d <= box_.high[axis]) {
      along.candidate = is_set(candidates, bit + step);
      if constexpr (Forecasting) along.forecast += forecast_.at(bit + step);
    }
    return along;
  }

  // Four contexts, each a different view of the known surroundings of a point.
  Contexts contexts_alone(Index3 p, std::size_t around, std::size_t beside) const {
    const std::size_t bit = bit_of(p);
    std::size_t on = 0, off = 0, ahead = 0, directed = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Along along = look_along<false>(axis, p, bit);
      on += along.state == 2;
      off += along.state == 1;
      ahead += along.candidate;
      directed = directed * 6 + along.state * 2 + along.candidate;
    }
    const std::size_t neighbours = (on * 4 + off) * 4 + ahead;  // < 64
    return {neighbours + 64 * std::min<std::size_t>((around + 1) / 2, 12), directed, around * 32 + beside,
            (beside / 2) * 64 + neighbours};
  }

  Contexts contexts_with_forecast(Index3 p, std::size_t around, std::size_t beside) const {
    const std::size_t bit = bit_of(p);
    std::size_t on = 0, off = 0, directed = 0, forecasts = 0, surprises = 0, at_border = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Along along = look_along<true>(axis, p, bit);
      on += along.state == 2;
      off += along.state == 1;
      directed = directed * 6 + along.state * 2 + along.candidate;
      forecasts += along.forecast;
      surprises = surprises * 3 + along.surprise;
      // The samples on the other side of the border are not known.
      if (p[axis] == box_.low[axis] || p[axis] == box_.high[axis]) at_border = 1;
    }
    const std::size_t own = 2 * forecast_.at(bit) + at_border;  // < 8
    return {(own * 19 + forecasts) * 16 + on * 4 + off, own * 27 + surprises, own * 216 + directed,
            (own * 13 + beside) * 13 + std::min<std::size_t>((around + 1) / 2, 12)};
  }

  std::size_t bit_of(Index3 p) const {
    const Index3 d = p - box_.low;
    return static_cast<std::size_t>(d.x + d.y * stride_.y + d.z * stride_.z);
  }

  Coder& coder_;
  LatticeBits& active_;
  const Forecast& forecast_;
  Box box_;
  Index3 stride_;
  Candidates candidates_;
  Pass pass_{};
  std::int64_t found_ = 0;
  std::size_t classes_;
  Contexts first_{};          ///< first context of each kind, within one class and cycle
  std::size_t contexts_ = 0;  ///< number of contexts of all kinds
  std::vector<AdaptiveBit> models_;
  std::vector<Mixer> mixers_;
};

// Heap bytes of the models and mixers, of one bit for every point, and of one row of bits.
std::uint64_t model_bytes(Index3 size, int cube_size, bool forecast) {
  std::uint64_t contexts = 0;
  for (const std::size_t size_of_kind : forecast ? sizes_with_forecast : sizes_alone)
    contexts += size_of_kind;
  const auto classes = static_cast<std::uint64_t>(max_level(cube_size));
  return classes * (contexts * sizeof(AdaptiveBit) + sizeof(Mixer)) + LatticeBits::working_bytes(size) +
         LatticeBits::working_bytes({size.x, 1, 1});
}

void set_root_corners(LatticeBits& active, int cube_size) {
  const Box& box = active.box();
  for (std::int64_t z = box.low.z; z <= box.high.z; z += cube_size)
    for (std::int64_t y = box.low.y; y <= box.high.y; y += cube_size)
      for (std::int64_t x = box.low.x; x <= box.high.x; x += cube_size) active.set({x, y, z});
}

// `known` is null if the coder decodes.
template <class Coder>
void code_activity(Coder& coder, LatticeBits& active, const Forecast& forecast, int cube_size, int max_level,
                   const LatticeBits* known) {
  set_root_corners(active, cube_size);
  ActivityModel<Coder> model(coder, active, forecast, cube_size);
  int cycle = 0;
  for (std::int64_t unit = cube_size / 2; unit >= 1; unit /= 2, ++cycle)
    for (int odd_count = 3; odd_count >= 1; --odd_count) {
      if (3 * cycle + 4 - odd_count > max_level) return;
      std::int64_t found = 0;
      for (unsigned axes = 1; axes < 8; ++axes)
        if (std::popcount(axes) == odd_count)
          found += model.code_pass(
              {unit, {(axes & 1) != 0, (axes & 2) != 0, (axes & 4) != 0}, odd_count, cycle}, known);
      // Every point has a parent in the level before.
      if (found == 0) return;
    }
}

}  // namespace

void encode_activity(const LatticeBits& active, const Forecast& forecast, int cube_size, int max_level,
                     std::vector<std::uint8_t>& out) {
  RansEncoder coder(out);
  LatticeBits coded(active.box());
  code_activity(coder, coded, forecast, cube_size, max_level, &active);
  coder.finish();
}

Status decode_activity(std::span<const std::uint8_t> bytes, const Forecast& forecast, int cube_size,
                       int max_level, LatticeBits& active) {
  RansDecoder coder(bytes);
  code_activity<RansDecoder>(coder, active, forecast, cube_size, max_level, nullptr);
  if (!coder.finished()) return Status::broken("the activity has the wrong number of bytes");
  return {};
}

std::uint64_t working_bytes_of_encoding_activity(Index3 size, int cube_size, bool forecast) {
  return model_bytes(size, cube_size, forecast) + LatticeBits::working_bytes(size) +
         RansEncoder::working_bytes(static_cast<std::uint64_t>(size.x * size.y * size.z));
}

std::uint64_t working_bytes_of_decoding_activity(Index3 size, int cube_size, bool forecast) {
  return model_bytes(size, cube_size, forecast);
}

}  // namespace tagrid
