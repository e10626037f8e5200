#include "stages/values/wavefront/contexts.h"

#include <algorithm>
#include <bit>

namespace tagrid {
namespace {

/// The smallest sum of residuals around whose class is `half_octave`.
std::uint32_t smallest_sum(int half_octave) {
  const auto class_of = [](std::uint32_t sum) {
    const auto number = std::bit_cast<std::uint32_t>(static_cast<float>(2 * sum + 1));
    return std::max(0, static_cast<int>(number >> 22) - 256);
  };
  std::uint32_t sum = 0;
  while (class_of(sum) < half_octave) ++sum;
  return sum;
}

SymbolModel model_for(std::uint32_t sum) {
  const int low_bits = std::max(0, static_cast<int>(std::bit_width(sum >> 4)) - 2);
  return geometric_model(sum + 1, std::uint64_t{16} << low_bits);
}

std::vector<std::int16_t> make_distributions() {
  std::vector<std::int16_t> all;
  all.reserve(distribution_elements);
  const auto append = [&all](const SymbolModel& model) {
    all.insert(all.end(), model.below.begin(), model.below.end());
  };
  for (int c = 0; c < texture_contexts; ++c) append(model_for(smallest_sum(c / 64)));
  for (int i = 0; i < 2; ++i) append(geometric_model(1, 64));
  for (int c = 0; c < level_contexts_of_wave; ++c) append(model_for(smallest_sum(c / 8 % 4 * 4 + 2)));
  for (int i = 0; i < 3; ++i) append(geometric_model(1, 64));
  return all;
}

}  // namespace

const std::vector<std::int16_t>& initial_distributions() {
  static const std::vector<std::int16_t> made_once = make_distributions();
  return made_once;
}

}  // namespace tagrid
