// Vector code against plain loops. Built three times: for this machine, without SSE2, and without vectors.
#include "stages/entropy/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace tagrid {
namespace {

// Sums of probabilities, as in symbol models.
Lanes any_lanes(std::mt19937& random) {
  Lanes lanes;
  const std::uint32_t most = random() % 4 == 0 ? 20 : 32768;
  for (auto& lane : lanes) lane = static_cast<std::int16_t>(random() % most);
  std::sort(lanes.begin(), lanes.end());
  return lanes;
}

TEST(Lanes, EveryLaneMovesTowardsItsTarget) {
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    const Lanes from = any_lanes(random), to = any_lanes(random);
    for (const int shift : {0, 1, 3, 6, 15}) {
      Lanes moved = from;
      move_towards(moved, to, shift);
      for (std::size_t lane = 0; lane < lane_count; ++lane)
        ASSERT_EQ(moved[lane], from[lane] + ((to[lane] - from[lane]) >> shift));
    }
  }
}

TEST(Lanes, MeanIsThatOfEveryLane) {
  std::mt19937 random(2);
  for (int i = 0; i < 2000; ++i) {
    const Lanes a = any_lanes(random), b = any_lanes(random), c = any_lanes(random);
    const Boundaries result = mean(a, b, c);
    EXPECT_EQ(result[0], 0);
    EXPECT_EQ(result[lane_count], 0);
    for (std::size_t lane = 1; lane < lane_count; ++lane)
      ASSERT_EQ(result[lane], (a[lane] + b[lane]) / 2 + c[lane]);
  }
}

TEST(Lanes, AnIntervalHoldsItsPlaces) {
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    Boundaries boundaries = mean(any_lanes(random), any_lanes(random), any_lanes(random));
    if (i % 2 == 0)  // up to the last place
      for (std::size_t lane = 1; lane < lane_count; ++lane)
        boundaries[lane] = static_cast<std::uint16_t>(boundaries[lane] | 0x8000u);
    std::sort(boundaries.begin(), boundaries.begin() + lane_count);
    std::vector<std::uint16_t> places = {0, 1, 32767, 32768, 65534, 65535};
    for (const std::uint16_t boundary : boundaries)
      for (const int beside : {-1, 0, 1}) places.push_back(static_cast<std::uint16_t>(boundary + beside));
    for (const std::uint16_t place : places) {
      std::size_t interval = lane_count - 1;
      while (boundaries[interval] > place) --interval;
      ASSERT_EQ(interval_of(place, boundaries), interval) << place;
    }
  }
}

}  // namespace
}  // namespace tagrid
