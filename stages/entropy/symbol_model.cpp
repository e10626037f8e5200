#include "stages/entropy/symbol_model.h"

namespace tagrid {

SymbolModel geometric_model(std::uint64_t mean, std::uint64_t of) {
  // If m is the mean magnitude, the ratio of neighbouring probabilities is (sqrt(1 + m^2) - 1) / m. This is
  // close to it: right in both limits, and computed in integers.
  const std::uint64_t ratio = (mean * (mean + of) << 16) / (2 * of * of + 2 * mean * of + mean * mean);
  std::array<std::uint64_t, 9> power = {65536};
  for (std::size_t i = 1; i < power.size(); ++i) power[i] = (power[i - 1] * ratio) >> 16;
  std::array<std::uint64_t, symbol_count> weight{};
  for (std::size_t s = 0; s < 15; ++s) weight[s] = power[s < 7 ? 7 - s : s - 7];
  weight[15] = (2 * power[8] << 16) / (65536 - ratio);
  std::uint64_t total = 0;
  for (const std::uint64_t w : weight) total += w;

  constexpr std::uint64_t least = 8;  // 2^-15, for each symbol
  SymbolModel model;
  std::uint64_t sum = 0;
  for (std::size_t s = 0; s < symbol_count; sum += weight[s++])
    model.below[s] = static_cast<std::int16_t>(sum * (32768 - least * symbol_count) / total + least * s);
  model.below[0] = start_age;
  return model;
}

}  // namespace tagrid
