#include "stages/values/best/residual_model.h"

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

}  // namespace tagrid
