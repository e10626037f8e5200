// The colours of the levels of a grid.
#pragma once

#include <array>

#include "stages/picture/image.h"

namespace tagrid {

/// The colour of a level from 0 (coarse) to `deepest`: from dark violet over red to light yellow, so that finer levels are
/// lighter also where colours are not seen. REQUIRES: 0 <= level <= deepest.
constexpr Colour colour_of_level(int level, int deepest) {
  constexpr std::array<Colour, 6> stops = {
      {{44, 18, 120}, {40, 100, 190}, {20, 160, 150}, {110, 200, 80}, {240, 205, 50}, {255, 245, 190}}};
  constexpr int parts = static_cast<int>(stops.size()) - 1;
  if (deepest == 0) return stops[0];
  const int place = level * parts * 256 / deepest;
  const int stop = std::min(place / 256, parts - 1);
  const auto at = static_cast<std::size_t>(stop);
  return mixed(stops[at], stops[at + 1], place - stop * 256);
}

}  // namespace tagrid
