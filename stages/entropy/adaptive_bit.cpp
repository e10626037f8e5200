#include "stages/entropy/adaptive_bit.h"

namespace tagrid {
namespace {

// The tables are computed at compile time, with + - * / only, so that they are the same everywhere.
constexpr double exponential(double x) {
  // exp(x) = exp(x / 1024)^1024; the series of the small argument converges after a few terms.
  const double small = x / 1024;
  double term = 1, sum = 1;
  for (int i = 1; i < 10; ++i) {
    term = term * small / i;
    sum = sum + term;
  }
  for (int i = 0; i < 10; ++i) sum = sum * sum;
  return sum;
}

constexpr std::array<std::uint16_t, 4096> make_squash() {
  std::array<std::uint16_t, 4096> table{};
  for (int i = 0; i < 4096; ++i) {
    const double p = 65536 / (1 + exponential(-(i - 2048) / 256.0));
    table[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(p < 1 ? 1 : p > 65535 ? 65535 : p);
  }
  return table;
}

constexpr std::array<std::int16_t, 4096> make_stretch() {
  std::array<std::int16_t, 4096> table{};
  const auto squash = make_squash();
  std::size_t at = 1;
  for (std::size_t i = 0; i < 4096; ++i) {
    while (at < 4095 && squash[at] < i * 16 + 8) ++at;
    table[i] = static_cast<std::int16_t>(static_cast<int>(at) - 2048);
  }
  return table;
}

constexpr std::array<std::uint16_t, 1024> make_adaptation() {
  std::array<std::uint16_t, 1024> table{};
  for (std::uint32_t i = 0; i < 1024; ++i) table[i] = static_cast<std::uint16_t>(65536 * 2 / (2 * i + 3));
  return table;
}

}  // namespace

constinit const std::array<std::int16_t, 4096> stretch_table = make_stretch();
constinit const std::array<std::uint16_t, 4096> squash_table = make_squash();
constinit const std::array<std::uint16_t, 1024> adaptation_table = make_adaptation();

}  // namespace tagrid
