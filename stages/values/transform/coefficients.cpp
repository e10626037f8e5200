#include "stages/values/transform/coefficients.h"

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "stages/entropy/rans_coder.h"
#include "stages/values/best/residual_model.h"
#include "stages/values/transform/magnitudes.h"

namespace tagrid {

CoefficientModel::CoefficientModel() {
  constexpr std::uint32_t seen_near = 12, seen_expected = 24, seen_flags = 20, seen_signs = 12;
  constexpr int unit = 16;
  for (std::size_t event = 0; event < magnitude_events; ++event) {
    for (std::size_t i = 0; i < near[event].size(); ++i)
      near[event][i] = AdaptiveBit(near_start[event][i] * unit, seen_near);
    for (std::size_t i = 0; i < expected[event].size(); ++i)
      expected[event][i] = AdaptiveBit(expected_start[event][i / orientations] * unit, seen_expected);
    weights[event].fill(first_mixer_weights);
    refined[event].fill(first_refinement());
  }
  for (std::size_t i = 0; i < sign_contexts; ++i) sign[i] = AdaptiveBit(sign_start[i] * unit, seen_signs);
  for (std::size_t i = 0; i < far_sign_contexts; ++i)
    far_sign[i] = AdaptiveBit(far_sign_start[i] * unit, seen_signs);
  sign_weights.fill(first_mixer_weights);
  for (std::size_t i = 0; i < band_contexts; ++i)
    zero_band[i] = AdaptiveBit(band_start[i] * unit, seen_flags);
  for (std::size_t i = 0; i < block_contexts; ++i)
    active_block[i] = AdaptiveBit(block_start[i] * unit, seen_flags);
}

namespace {

constexpr std::uint32_t forget_flags_after = 255;
constexpr std::int64_t block = coefficient_block;
constexpr std::int32_t largest_magnitude = 1 << 24;

// What an encoder weighs: a bit costs this part of the square of a step.
constexpr float lambda = 0.07f;
// A block is coded if one of its coefficients is at least this part of a step.
constexpr float least_active = 0.8f;

// Classes of a sum of magnitudes.
constexpr std::array<std::uint8_t, 64> near_class = [] {
  std::array<std::uint8_t, 64> classes{};
  for (std::size_t v = 0; v < 64; ++v)
    classes[v] = static_cast<std::uint8_t>(v < 4    ? v
                                           : v < 6  ? 4
                                           : v < 8  ? 5
                                           : v < 11 ? 6
                                           : v < 15 ? 7
                                           : v < 22 ? 8
                                           : v < 34 ? 9
                                           : v < 60 ? 10
                                                    : 11);
  return classes;
}();
std::size_t class_of_block(std::uint32_t sum) { return sum < 3 ? sum : sum < 6 ? 3 : sum < 15 ? 4 : 5; }

template <class Coder>
class CoefficientPass {
 public:
  CoefficientPass(Coder& coder, CoefficientModel& model, const TransformShape& shape,
                  std::span<std::int32_t> coefficients)
      : coder_(coder), model_(model), shape_(shape), coefficients_(coefficients.data()), magnitudes_(shape) {}

  bool run() {
    code_means();
    for (std::size_t i = 1; i < shape_.bands.size(); ++i) {
      code_band(i);
      if (coder_.exhausted()) return false;
    }
    return true;
  }

 private:
  std::int32_t* row_of(const Band& band, std::int64_t y, std::int64_t z) {
    return coefficients_ + ((band.low.z + z) * shape_.size.y + band.low.y + y) * shape_.size.x + band.low.x;
  }

  static std::int32_t dequantized(std::int64_t level, std::uint32_t step) {
    return static_cast<std::int32_t>(static_cast<std::uint64_t>((level * std::int64_t{step} + 128) >> 8));
  }

  // The axes along which a coefficient is the first or the last one of its band, as in Band::steps.
  static std::size_t end_along_x(const Band& band, std::int64_t x) { return x == 0 || x == band.size.x - 1; }
  static std::size_t ends_of_row(const Band& band, std::int64_t y, std::int64_t z) {
    return (y == 0 || y == band.size.y - 1 ? 2U : 0U) + (z == 0 || z == band.size.z - 1 ? 4U : 0U);
  }

  // The lowest band: differences to predictions.
  void code_means() {
    const Band& band = shape_.bands[0];
    const auto n = static_cast<std::size_t>(band.size.x * band.size.y * band.size.z);
    std::vector<std::int32_t> levels(n);
    const std::int64_t row = band.size.x, slice = band.size.x * band.size.y;
    std::int32_t* level = levels.data();
    for (std::int64_t z = 0; z < band.size.z; ++z)
      for (std::int64_t y = 0; y < band.size.y; ++y) {
        std::int32_t* const c = row_of(band, y, z);
        for (std::int64_t x = 0; x < band.size.x; ++x, ++level) {
          std::int64_t sum = 0, count = 0;
          if (x > 0) sum += level[-1], ++count;
          if (y > 0) sum += level[-row], ++count;
          if (z > 0) sum += level[-slice], ++count;
          // Rounded down, also below 0.
          const std::int64_t predicted = count == 0   ? 0
                                         : count == 1 ? sum
                                         : count == 2 ? sum >> 1
                                                      : (sum * 21846) >> 16;
          std::int64_t difference = 0;
          if constexpr (Coder::encoding) {
            const std::int64_t magnitude =
                (std::abs(std::int64_t{c[x]}) * 256 + band.steps[0] / 2) / band.steps[0];
            const std::int64_t limited = std::min<std::int64_t>(magnitude, largest_magnitude);
            difference = (c[x] < 0 ? -limited : limited) - predicted;
          }
          difference = model_.means.code_signed(coder_, difference);
          *level = static_cast<std::int32_t>(
              std::clamp<std::int64_t>(predicted + difference, -largest_magnitude, largest_magnitude));
          c[x] = dequantized(*level, band.steps[0]);
        }
      }
  }

  void code_band(std::size_t number) {
    const Band& band = shape_.bands[number];
    BandPlace& own = magnitudes_.place(number);
    const std::span<std::uint8_t> active = magnitudes_.active_blocks(own);
    bool is_zero = false;
    if constexpr (Coder::encoding) is_zero = !find_active(band, own, active);
    std::size_t siblings = 0;
    for (const int sibling : band.siblings) siblings += !magnitudes_.is_zero(sibling);
    const auto context = static_cast<std::size_t>(std::min(band.level, 6)) * 8 + siblings * 2 +
                         !magnitudes_.is_zero(band.parent);
    is_zero = code_adaptive(coder_, is_zero, model_.zero_band[context], forget_flags_after);
    own.is_zero = is_zero;
    if (is_zero) {
      if constexpr (Coder::encoding)
        for (std::int64_t z = 0; z < band.size.z; ++z)
          for (std::int64_t y = 0; y < band.size.y; ++y) std::fill_n(row_of(band, y, z), band.size.x, 0);
      return;
    }
    code_blocks(band, own, active);
    const Surroundings around = magnitudes_.surroundings_of(band, own);
    for (std::int64_t z = 0; z < band.size.z; ++z) {
      for (std::int64_t y = 0; y < band.size.y; ++y) {
        std::int32_t* const c = row_of(band, y, z);
        const std::size_t first =
            static_cast<std::size_t>(((z / block) * own.blocks.y + y / block) * own.blocks.x);
        for (std::int64_t x = 0; x < band.size.x; x += block) {
          const std::int64_t n = std::min(block, band.size.x - x);
          const std::size_t at = first + static_cast<std::size_t>(x / block);
          if (active[at] != 0)
            magnitudes_.sum_of_block(own, at) += code_group(band, own, around, c + x, {x, y, z}, n);
          else if constexpr (Coder::encoding)
            std::fill_n(c + x, n, 0);
        }
        if (coder_.exhausted()) return;
      }
    }
  }

  // Of an encoder: which blocks have a coefficient that may not be 0. False if none has.
  bool find_active(const Band& band, const BandPlace& own, std::span<std::uint8_t> active) {
    std::array<std::int32_t, 8> least;
    for (std::size_t ends = 0; ends < least.size(); ++ends)
      least[ends] = static_cast<std::int32_t>(
          std::min(static_cast<float>(band.steps[ends]) * (least_active / 256), 2e9f));
    bool any = false;
    for (std::int64_t z = 0; z < band.size.z; ++z)
      for (std::int64_t y = 0; y < band.size.y; ++y) {
        const std::int32_t* const c = row_of(band, y, z);
        std::uint8_t* const flags = active.data() + ((z / block) * own.blocks.y + y / block) * own.blocks.x;
        const std::size_t ends = ends_of_row(band, y, z);
        for (std::int64_t x = 0; x < band.size.x; ++x) {
          const std::int32_t limit = least[ends + end_along_x(band, x)];
          if (c[x] > limit || c[x] < -limit) {
            flags[x / block] = 1;
            any = true;
          }
        }
      }
    return any;
  }

  void code_blocks(const Band& band, const BandPlace& own, std::span<std::uint8_t> active) {
    if (active.size() == 1) {
      active[0] = 1;
      return;
    }
    const std::int64_t row = own.blocks.x, slice = own.blocks.x * own.blocks.y;
    std::uint8_t* flag = active.data();
    for (std::int64_t z = 0; z < own.blocks.z; ++z)
      for (std::int64_t y = 0; y < own.blocks.y; ++y)
        for (std::int64_t x = 0; x < own.blocks.x; ++x, ++flag) {
          const int neighbours = (x > 0 && flag[-1]) + (y > 0 && flag[-row]) + (z > 0 && flag[-slice]);
          const std::size_t context = ((static_cast<std::size_t>(neighbours) * 6 +
                                        class_of_block(magnitudes_.parent_of_block(band, {x, y, z}))) *
                                           6 +
                                       class_of_block(magnitudes_.siblings_of_block(band, {x, y, z}))) *
                                          2 +
                                      (band.level == 1);
          *flag = code_adaptive(coder_, *flag != 0, model_.active_block[context], forget_flags_after);
        }
  }

  /// Returns the sum of the magnitudes.
  std::uint32_t code_group(const Band& band, const BandPlace& own, const Surroundings& around,
                           std::int32_t* c, Index3 at, std::int64_t n) {
    const GroupContext group = magnitudes_.look_around(band, own, around, at);
    std::uint8_t* m = magnitudes_.at(own, at);
    const auto level_context = static_cast<std::size_t>(std::min(band.level - 1, 3)) * 3;
    std::uint32_t sum = 0;
    const std::size_t ends = ends_of_row(band, at.y, at.z);
    for (std::size_t k = 0; k < static_cast<std::size_t>(n); ++k, ++m, ++c) {
      const std::int32_t left = m[-1], left_2 = m[-2];
      const std::size_t place = ends + end_along_x(band, at.x + static_cast<std::int64_t>(k));
      // Most neighbours have the step of the band; of a finer one, larger magnitudes are expected.
      const std::int64_t weighted = group.expected[k] + around.weights[0] * left + around.weights[9] * left_2;
      const auto expected = static_cast<std::int32_t>(
          std::clamp<std::int64_t>(weighted * band.finer[place] >> 8, 0, (1 << 22) - 1));
      const std::size_t expected_class = std::min(log_scale<1>(static_cast<std::uint32_t>(expected)), 31u);
      const std::int32_t near = std::min(group.around[k] + 2 * left + left_2, 63),
                         parent = std::min(group.parent[k], 63);
      Context context;
      context.near = static_cast<std::size_t>(near_class[static_cast<std::size_t>(near)] * 12 +
                                              near_class[static_cast<std::size_t>(parent)]);
      context.expected = expected_class * orientations + static_cast<std::size_t>(band.orientation);
      context.mixer = level_context + (expected_class == 0 ? 0 : expected_class < 16 ? 1 : 2);
      context.refined = expected_class / 2;
      const std::uint32_t step = band.steps[place];
      std::int32_t magnitude = 0;
      bool negative = false;
      if constexpr (Coder::encoding) {
        negative = *c < 0;
        const float per_step = 256.0f / static_cast<float>(step);
        magnitude = encode_magnitude(context, static_cast<float>(std::abs(std::int64_t{*c})) * per_step);
      } else {
        magnitude = decode_magnitude(context);
      }
      if (magnitude > 0) {
        negative = code_sign(band, around, m, negative);
        sum += static_cast<std::uint32_t>(*m = static_cast<std::uint8_t>(std::min(magnitude, 255)));
      }
      *c = dequantized(negative ? -std::int64_t{magnitude} : magnitude, step);
    }
    return sum;
  }

  struct Context {
    std::size_t near, expected, mixer, refined;
  };
  MixedEvent predict(std::size_t event, const Context& context) {
    return {model_.near[event][context.near], model_.expected[event][context.expected],
            model_.weights[event][context.mixer], &model_.refined[event][context.refined]};
  }

  bool code_event(const MixedEvent& event, bool bit) {
    bit = coder_.code(bit, event.probability());
    event.learn(bit);
    return bit;
  }

  bool code_sign(const Band& band, const Surroundings& around, const std::uint8_t* m, bool negative) {
    std::uint8_t* const s = magnitudes_.sign_of(m);
    const auto of = [&](std::size_t neighbour) { return std::size_t{s[around.own[neighbour]]}; };
    const auto orientation = static_cast<std::size_t>(band.orientation);
    const std::size_t near = (orientation * 27 + of(0) * 9 + of(1) * 3 + of(2)) * 2 + (band.level == 1),
                      far = orientation * 81 + of(9) * 27 + of(10) * 9 + of(11) * 3 + of(8);
    const MixedEvent event(model_.sign[near], model_.far_sign[far], model_.sign_weights[orientation],
                           nullptr);
    negative = code_event(event, negative);
    *s = negative ? 0 : 2;
    return negative;
  }

  /// In squared steps.
  static float cost(const MixedEvent& event, bool bit) {
    return static_cast<float>(event.cost(bit)) * (lambda / 256);
  }

  /// Chooses a magnitude that is small for its bits. `a`: the magnitude in steps.
  std::int32_t encode_magnitude(const Context& context, float a) {
    const auto nearest = static_cast<std::int32_t>(std::min(a + 0.5f, static_cast<float>(largest_magnitude)));
    std::array<MixedEvent, magnitude_events> events;
    events[0] = predict(0, context);
    std::int32_t chosen = nearest;
    if (nearest > 0) {
      const auto last = static_cast<std::size_t>(std::min<std::int32_t>(nearest, magnitude_events - 1));
      for (std::size_t e = 1; e <= last; ++e) events[e] = predict(e, context);
      if (nearest < static_cast<std::int32_t>(magnitude_events)) {
        // The costs of this magnitude and of the one below it, without the events that they share; at last 0.
        const auto n = static_cast<std::size_t>(nearest);
        const float off = a - static_cast<float>(nearest);
        float best =
            off * off + cost(events[n], false) + cost(events[n - 1], true) + (nearest == 1 ? lambda : 0);
        const float below = (off + 1) * (off + 1) + cost(events[n - 1], false);
        if (below < best) {
          best = below;
          chosen = nearest - 1;
        }
        if (nearest == 2) {
          // Compared with 0, 1 and 2 have a sign and exceed 0.
          best += cost(events[0], true) + lambda;
          if (a * a + cost(events[0], false) < best) chosen = 0;
        }
      }
    }
    const std::int32_t unary = std::min<std::int32_t>(chosen, magnitude_events);
    for (std::int32_t e = 0; e <= unary && e < static_cast<std::int32_t>(magnitude_events); ++e)
      code_event(events[static_cast<std::size_t>(e)], chosen > e);
    if (unary == static_cast<std::int32_t>(magnitude_events))
      model_.far.code(coder_, static_cast<std::uint64_t>(chosen - unary));
    return chosen;
  }

  std::int32_t decode_magnitude(const Context& context) {
    for (std::size_t e = 0; e < magnitude_events; ++e)
      if (!code_event(predict(e, context), false)) return static_cast<std::int32_t>(e);
    return static_cast<std::int32_t>(
        std::min<std::uint64_t>(magnitude_events + model_.far.code(coder_, 0), largest_magnitude));
  }

  Coder& coder_;
  CoefficientModel& model_;
  const TransformShape& shape_;
  std::int32_t* coefficients_;
  Magnitudes magnitudes_;
};

}  // namespace

std::uint64_t working_bytes_of_coefficients(Index3 size) {
  std::uint64_t most = 0;
  for (int split = 0; split < split_count; ++split) {
    const TransformShape shape = transform_shape(size, static_cast<Split>(split), 1, 0);
    std::uint64_t bytes = shape.bands.size() * sizeof(Band) + Magnitudes::working_bytes(shape);
    const Index3 means = shape.bands[0].size;
    bytes += static_cast<std::uint64_t>(means.x * means.y * means.z) * sizeof(std::int32_t);
    most = std::max(most, bytes);
  }
  return most;
}

template <class Coder>
bool code_coefficients(Coder& coder, CoefficientModel& model, const TransformShape& shape,
                       std::span<std::int32_t> coefficients) {
  return CoefficientPass<Coder>(coder, model, shape, coefficients).run();
}

template bool code_coefficients(LimitedEncoder&, CoefficientModel&, const TransformShape&,
                                std::span<std::int32_t>);
template bool code_coefficients(RansDecoder&, CoefficientModel&, const TransformShape&,
                                std::span<std::int32_t>);

}  // namespace tagrid
