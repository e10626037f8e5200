#include "stages/values/best/residual_model.h"

#include <algorithm>
#include <cstdlib>

#include "stages/entropy/rans_coder.h"

namespace tagrid {

namespace {

// Below 2^22, every class of log_scale<2> lies within a class of log_scale<1> and has one number of low bits.
std::array<std::uint32_t, energy_classes> smallest_energies() {
  std::array<std::uint32_t, energy_classes> smallest{};
  std::uint32_t energy = 0;
  for (std::uint32_t c = 0; c < energy_classes; ++c) {
    // Some of the first classes are empty.
    while (log_scale<2>(energy) < c) ++energy;
    smallest[c] = energy;
  }
  return smallest;
}
const std::array<std::uint32_t, energy_classes> smallest_energy = smallest_energies();

int low_bits_for(std::uint32_t energy) {
  return std::max(0, static_cast<int>(std::bit_width(energy >> 4)) - 2);
}

std::array<EnergyClass, energy_classes> make_energy_classes() {
  std::array<EnergyClass, energy_classes> classes{};
  for (std::size_t c = 0; c < energy_classes; ++c) {
    const std::uint32_t coarse = std::min<std::uint32_t>(log_scale<1>(smallest_energy[c]), 15);
    classes[c] = {static_cast<std::uint8_t>(coarse / 2), static_cast<std::uint8_t>(coarse / 4),
                  static_cast<std::uint8_t>(low_bits_for(smallest_energy[c]))};
  }
  return classes;
}

}  // namespace

const std::array<EnergyClass, energy_classes> energy_class_table = make_energy_classes();

namespace {

constexpr std::uint32_t forget_after = 400;   ///< observations of an adaptive bit
constexpr std::int32_t first_weight = 10240;  ///< initial weight of a context, in 2^-16
constexpr std::int32_t weight_limit_mixed = 1 << 19;

template <class Weights>
std::int32_t mix(const std::array<std::int32_t, mixed_contexts>& inputs, const Weights& weights) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < mixed_contexts; ++i) sum += inputs[i] * (weights[i] >> 4);
  return std::clamp(sum >> 12, -2047, 2047);
}

template <class Weights>
void learn(const std::array<std::int32_t, mixed_contexts>& inputs, std::int32_t error, Weights& weights) {
  for (std::size_t i = 0; i < mixed_contexts; ++i)
    weights[i] = std::clamp(weights[i] + ((inputs[i] * error * 3 + (1 << 14)) >> 15), -weight_limit_mixed,
                            weight_limit_mixed);
}

}  // namespace

MixedResidualModel::MixedResidualModel()
    : by_energy_(64 * events), by_spread_(256 * events), refined_(64 * events) {
  for (std::size_t c = 0; c < mixed_contexts; ++c) bits_[c].resize(mixed_context_sizes[c] * events);
  MixerWeights start;
  start.fill(first_weight);
  std::fill(by_energy_.begin(), by_energy_.end(), start);
  std::fill(by_spread_.begin(), by_spread_.end(), start);
  std::array<std::uint16_t, refinement_steps> identity;
  for (std::size_t i = 0; i < refinement_steps; ++i)
    identity[i] = squash_table[std::min<std::size_t>(i * 128, 4095)];
  std::fill(refined_.begin(), refined_.end(), identity);
}

template <class Coder>
bool MixedResidualModel::code_event(Coder& coder, bool bit, std::uint32_t event,
                                    const MixedContext& context) {
  std::array<AdaptiveBit*, mixed_contexts> models;
  std::array<std::int32_t, mixed_contexts> inputs;
  for (std::size_t i = 0; i < mixed_contexts; ++i) {
    models[i] = &bits_[i][context.of[i] * events + event];
    inputs[i] = models[i]->stretched();
  }
  const std::size_t row = context.energy * events + event;
  MixerWeights& first = by_energy_[row];
  MixerWeights& second = by_spread_[context.spread * events + event];
  const std::int32_t mixed_first = mix(inputs, first), mixed_second = mix(inputs, second);
  const auto mixed = static_cast<std::uint32_t>(((mixed_first + mixed_second) >> 1) + 2048);
  std::uint16_t* between = &refined_[row][mixed >> 7];
  const std::uint32_t part = mixed & 127;
  const std::uint32_t refined = (between[0] * (128 - part) + between[1] * part) >> 7;
  bit = coder.code(bit, std::clamp<std::uint32_t>((squash_table[mixed] + refined) >> 1, 1, 65535));

  const std::int32_t target = bit ? 65535 : 0;
  std::uint16_t& nearer = between[part > 64];
  nearer = static_cast<std::uint16_t>(nearer + ((target - nearer) >> 6));
  learn(inputs, (target - squash_table[static_cast<std::size_t>(mixed_first + 2048)]) >> 1, first);
  learn(inputs, (target - squash_table[static_cast<std::size_t>(mixed_second + 2048)]) >> 1, second);
  for (AdaptiveBit* model : models) model->learn(bit, forget_after);
  return bit;
}

template <class Coder>
std::int32_t MixedResidualModel::code(Coder& coder, std::int32_t residual, std::int32_t largest,
                                      const MixedContext& context) {
  if (!code_event(coder, residual != 0, zero, context)) return 0;
  const bool negative = code_event(coder, residual < 0, sign, context);
  const int k = context.low_bits;
  const auto given = static_cast<std::uint32_t>(std::abs(residual)) - 1;
  const std::uint32_t given_high = given >> k;
  std::uint32_t high = 0;
  while (high < unary_limit && code_event(coder, given_high > high, beyond + high, context)) ++high;
  // A brick of samples of 16 bits cannot have a larger residual.
  if (high == unary_limit)
    high += static_cast<std::uint32_t>(
        std::min<std::uint64_t>(far_.code(coder, std::uint64_t{given_high} - unary_limit), 1 << 18));
  std::uint32_t magnitude = high;
  const std::uint32_t node = low + 4 * std::min(high, 3u);
  if (k > 0) {
    const bool top = code_event(coder, given >> (k - 1) & 1, node, context);
    magnitude = magnitude << 1 | top;
    if (k > 1) magnitude = magnitude << 1 | code_event(coder, given >> (k - 2) & 1, node + 1 + top, context);
    if (k > 2) magnitude = magnitude << (k - 2) | coder.code_raw(given & ((1u << (k - 2)) - 1), k - 2);
  }
  const auto limited =
      static_cast<std::int32_t>(std::min<std::uint32_t>(magnitude + 1, static_cast<std::uint32_t>(largest)));
  return negative ? -limited : limited;
}

template std::int32_t MixedResidualModel::code(RansEncoder&, std::int32_t, std::int32_t, const MixedContext&);
template std::int32_t MixedResidualModel::code(RansDecoder&, std::int32_t, std::int32_t, const MixedContext&);

}  // namespace tagrid
