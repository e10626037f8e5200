// Rows of bricks that are encoded separately, with as little memory as possible, are the same as in the whole
// volume.
#include <gtest/gtest.h>

#include "io/tag/file.h"
#include "pipeline/encode/graph.h"
#include "tests/support/graph_ends.h"
#include "tests/support/sanitized.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

struct Brick : BrickBytes {
  double mesh_error = -1;
};
using Bricks = std::vector<Brick>;

Bricks encoded(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget) {
  static const std::vector<std::int16_t> samples = blobs<std::int16_t>(parameters.dims, 1);
  Bricks bricks;
  auto slices = slices_of(parameters.dims, samples);
  BricksInto sink([&](const BrickBytes& brick, const Statistics& statistics) {
    bricks.push_back({brick, statistics.mesh_error});
  });
  Watch unwatched;
  encode(job_of(parameters, budget), rows, slices, sink, unwatched);
  return bricks;
}

class Rows : public testing::TestWithParam<std::tuple<int, double, FileMode>> {};

TEST_P(Rows, GiveTheSameBricksAsTheWhole) {
  const auto [edge, mesh_error, mode] = GetParam();
  const CodingParameters parameters = parameters_of_many_bricks(edge, mode, mesh_error);
  const BrickGrid bricks = parameters.bricks();
  const Bricks whole = encoded(parameters, BrickRows::all(bricks), generous_encoding(parameters, 2));
  ASSERT_EQ(static_cast<std::int64_t>(whole.size()), bricks.count());
  std::vector<BrickRows> stretches;
  for (std::int64_t z = 0; z < bricks.bricks(2); ++z) {
    for (std::int64_t y = 0; y < bricks.bricks(1); ++y) stretches.push_back({y, y + 1, z, z + 1});
    stretches.push_back({0, bricks.bricks(1), z, bricks.bricks(2)});
    stretches.push_back({bricks.bricks(1) / 2, bricks.bricks(1), z, z + 1});
  }
  for (const BrickRows& rows : stretches) {
    const Bricks part = encoded(parameters, rows, {1, 0, 1});
    ASSERT_EQ(static_cast<std::int64_t>(part.size()), rows.count(bricks));
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Brick& expected = whole[static_cast<std::size_t>(rows.first_brick(bricks)) + i];
      EXPECT_EQ(part[i].id, expected.id);
      EXPECT_EQ(part[i].activity, expected.activity) << "brick " << part[i].id;
      EXPECT_EQ(part[i].values, expected.values) << "brick " << part[i].id;
      EXPECT_EQ(part[i].mesh_error, expected.mesh_error) << "brick " << part[i].id;
      EXPECT_EQ(part[i].mesh_error >= 0, mesh_error >= 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Rows,
                         testing::Combine(testing::Range(1, sanitized ? 3 : 4), testing::Values(-1.0, 40.0),
                                          testing::Values(FileMode::voxels, FileMode::grid)));

}  // namespace
}  // namespace tagrid
