#include "stages/residual_coding.h"

namespace tagrid {
namespace {

/// The smallest value of a step of log_scale<m>.
template <int m>
constexpr std::uint32_t log_scale_start(std::uint32_t step) {
  if (step < (2u << m)) return step;
  const std::uint32_t octave = (step >> m) - 1;
  return (step - (octave << m)) << octave;
}

/// Where nothing was observed yet, the residuals around say how large the next one may be.
SymbolModel start_for(std::uint32_t energy) {
  return geometric_model(energy + 1, std::uint64_t{16} << low_bits_for(energy));
}

}  // namespace

ResidualModel::ResidualModel() {
  for (std::uint32_t i = 0; i < energy_contexts; ++i) energy_[i] = start_for(log_scale_start<2>(i / 3));
  for (std::uint32_t i = 0; i < spread_contexts; ++i)
    spread_[i] = start_for(log_scale_start<1>(i % 8 * 2 + 1));
  for (std::uint32_t i = 0; i < level_contexts; ++i)
    level_[i] = start_for(log_scale_start<1>(i / 4 % 4 * 4 + 2));
}

}  // namespace tagrid
