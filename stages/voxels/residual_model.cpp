#include "stages/voxels/residual_model.h"

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

/// The smallest energy whose log_scale<1> is `step`.
std::uint32_t energy_at(std::uint32_t step) {
  std::uint32_t energy = 0;
  while (log_scale<1>(energy) < step) ++energy;
  return energy;
}

/// Before anything is observed, the residuals around say how large the next one may be.
SymbolModel start_for(std::uint32_t energy) {
  return geometric_model(energy + 1, std::uint64_t{16} << low_bits_for(energy));
}

/// Start models by the classes of EnergyClass.
struct Starts {
  std::array<SymbolModel, energy_classes> of_energy;
  std::array<SymbolModel, 8> of_8;
  std::array<SymbolModel, 4> of_4;

  Starts() {
    for (std::uint32_t i = 0; i < energy_classes; ++i) of_energy[i] = start_for(smallest_energy[i]);
    for (std::uint32_t i = 0; i < 8; ++i) of_8[i] = start_for(energy_at(i * 2 + 1));
    for (std::uint32_t i = 0; i < 4; ++i) of_4[i] = start_for(energy_at(i * 4 + 2));
  }
};

const Starts& starts() {
  static const Starts made_once;
  return made_once;
}

}  // namespace

const std::array<EnergyClass, energy_classes> energy_class_table = make_energy_classes();

ThreeDistributions::ThreeDistributions() {
  for (std::size_t i = 0; i < energy_contexts; ++i) energy_[i] = starts().of_energy[i / 3];
  for (std::size_t i = 0; i < spread_contexts; ++i) spread_[i] = starts().of_8[i % 8];
  for (std::size_t i = 0; i < level_contexts; ++i) level_[i] = starts().of_4[i / 4 % 4];
}

OneDistribution::OneDistribution() {
  for (std::size_t i = 0; i < energy_contexts; ++i) energy_[i] = starts().of_energy[i / 3];
}

}  // namespace tagrid
