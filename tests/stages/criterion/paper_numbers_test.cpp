// The tables of the paper: limited runs on its two volumes, as far as we have them.
#include <gtest/gtest.h>

#include "tests/support/encode_volume.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

struct Row {
  int level;
  std::uint64_t points;  ///< of the non-adaptive grid, exact
  double expected;       ///< percent active, with the criterion as defined
  double low, high;      ///< results of other readings of the damaged formulas
};

template <class T>
void expect_rows(const oracle::Volume<T>& volume, double field_scale, std::initializer_list<Row> rows) {
  for (const Row& row : rows) {
    const LatticeBits active = activity_of(volume, 32, {20, field_scale, row.level});
    const std::uint64_t all = points_up_to_level({volume.dims, 32})[static_cast<std::size_t>(row.level)];
    EXPECT_EQ(all, row.points) << "level " << row.level;
    const double percent = 100 * static_cast<double>(count_of(active)) / static_cast<double>(all);
    EXPECT_NEAR(percent, row.expected, 0.051) << "level " << row.level;
    EXPECT_GE(percent, row.low) << "level " << row.level;
    EXPECT_LE(percent, row.high) << "level " << row.level;
    std::int64_t beyond = 0;
    const Box& box = active.box();
    for (const auto [x, y, z] : points_of(Box{{}, box.high}))
      beyond += active.test({x, y, z}) && classify({x, y, z}, 32).level > row.level;
    EXPECT_EQ(beyond, 0) << "level " << row.level;
  }
}

TEST(PaperNumbers, LimitedRunsOnTheLobster) {
  const auto lobster = read_volume<std::uint8_t>("lobster_321x321x33.raw", {321, 321, 33});
  if (lobster.samples.empty()) GTEST_SKIP() << "lobster_321x321x33.raw is not beside the source tree";
  expect_rows(lobster, 8.0 / 252,
              {{3, 1323, 18.3, 18, 35},
               {6, 8405, 13.4, 10, 26},
               {9, 59049, 16.0, 12, 22},
               {12, 440657, 12.9, 8, 14},
               {15, 3400353, 9.0, 7.5, 10.5}});
}

TEST(PaperNumbers, LimitedRunsOnTheFoot) {
  const auto foot = read_volume<std::int16_t>("foot_161x321x129.raw", {161, 321, 129});
  if (foot.samples.empty()) GTEST_SKIP() << "foot_161x321x129.raw is not beside the source tree";
  expect_rows(foot, 8.0 / (1693 + 1024), {{9, 109593, 18.0, 13, 19}, {12, 847665, 12.8, 8.5, 14}});
}

// A limited run is not the prefix of the full grid.
TEST(PaperNumbers, ThePrefixOfTheFullLobsterHoldsMoreThanTheLimitedRun) {
  const auto lobster = read_volume<std::uint8_t>("lobster_321x321x33.raw", {321, 321, 33});
  if (lobster.samples.empty()) GTEST_SKIP() << "lobster_321x321x33.raw is not beside the source tree";
  const LatticeBits active = activity_of(lobster, 32, {20, 8.0 / 252, 15});
  double prefix = 0;
  const Box& box = active.box();
  for (const auto [x, y, z] : points_of(Box{{}, box.high}))
    prefix += active.test({x, y, z}) && classify({x, y, z}, 32).level <= 12;
  EXPECT_NEAR(100 * prefix / 440657, 22, 0.5);
}

}  // namespace
}  // namespace tagrid
