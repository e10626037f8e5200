// Means of blocks: rounding, ends of axes, and blocks without a finite sample.
#include "stages/overview/block_sums.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace tagrid {
namespace {

// The means of a volume of one row of blocks along x.
template <class T>
std::vector<T> means_of(const std::vector<T>& samples, const Index3& dims) {
  const SumsLayout layout = layout_of_sums(dims, sample_type_of<T>(), block_edge);
  SlabSums sums(layout, dims.x, dims.y);
  const auto slice = static_cast<std::size_t>(dims.x * dims.y);
  for (std::size_t z = 0; z < static_cast<std::size_t>(dims.z); ++z)
    sums.add_slice(reinterpret_cast<const std::byte*>(samples.data() + z * slice));
  std::vector<std::byte> row;
  sums.take(row);
  std::vector<T> means(static_cast<std::size_t>(layout.blocks.x));
  means_of_row(layout, dims, 0, 0, row, reinterpret_cast<std::byte*>(means.data()));
  return means;
}

TEST(BlockSums, MeansAreRoundedToTheNearestIntegerAndUpInTheMiddle) {
  EXPECT_EQ(means_of<std::uint8_t>({1, 2}, {2, 1, 1}), (std::vector<std::uint8_t>{2}));
  EXPECT_EQ(means_of<std::int8_t>({-1, -2}, {2, 1, 1}), (std::vector<std::int8_t>{-1}));
  EXPECT_EQ(means_of<std::int8_t>({-1, -1, -2}, {3, 1, 1}), (std::vector<std::int8_t>{-1}));
  EXPECT_EQ(means_of<std::int8_t>({-2, -1, -2}, {3, 1, 1}), (std::vector<std::int8_t>{-2}));
}

TEST(BlockSums, TheLastBlockHasTheSamplesThatAreThere) {
  EXPECT_EQ(means_of<std::uint16_t>({0, 0, 0, 4, 65535}, {5, 1, 1}), (std::vector<std::uint16_t>{1, 65535}));
  EXPECT_EQ(means_of<std::uint16_t>({1, 2, 3, 4, 5, 6}, {1, 2, 3}), (std::vector<std::uint16_t>{4}));
}

TEST(BlockSums, TheLargestSumsFit) {
  const auto high = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(means_of(std::vector<std::uint32_t>(64, high), {4, 4, 4}), (std::vector<std::uint32_t>{high}));
  const auto low = std::numeric_limits<std::int32_t>::min();
  EXPECT_EQ(means_of(std::vector<std::int32_t>(64, low), {4, 4, 4}), (std::vector<std::int32_t>{low}));
}

TEST(BlockSums, OnlyFiniteSamplesCount) {
  const float infinity = INFINITY;
  EXPECT_EQ(means_of<float>({1, NAN, 2, infinity}, {4, 1, 1}), (std::vector<float>{1.5F}));
  EXPECT_TRUE(std::isnan(means_of<float>({NAN, infinity}, {2, 1, 1}).front()));
  const double most = std::numeric_limits<double>::max();
  EXPECT_TRUE(std::isnan(means_of<double>({most, most}, {2, 1, 1}).front()));
}

template <class T>
void expect_sums_of_rows(const Index3& dims) {
  std::mt19937 random(1);
  const std::int64_t slices = std::min(dims.z, block_edge);
  std::vector<T> samples(static_cast<std::size_t>(dims.x * dims.y * slices));
  for (T& sample : samples) sample = static_cast<T>(static_cast<int>(random() % 256) - 128);
  const SumsLayout layout = layout_of_sums(dims, sample_type_of<T>(), block_edge);
  SlabSums whole(layout, dims.x, dims.y), in_parts(layout, dims.x, dims.y);
  for (std::int64_t z = 0; z < slices; ++z) {
    const auto* slice = reinterpret_cast<const std::byte*>(samples.data() + z * dims.x * dims.y);
    whole.add_slice(slice);
    // The last stretch first.
    std::vector<std::int64_t> ends = {dims.y};
    for (std::int64_t y = dims.y / block_edge * block_edge; y > 0; y -= block_edge)
      if (y < dims.y && random() % 2) ends.push_back(y);
    for (std::size_t i = 0; i < ends.size(); ++i)
      in_parts.add_rows(slice, i + 1 < ends.size() ? ends[i + 1] : 0, ends[i]);
  }
  std::vector<std::byte> expected, found;
  whole.take(expected);
  in_parts.take(found);
  EXPECT_EQ(found, expected);
}

TEST(BlockSums, RowsCanBeAddedInAnyStretchesAndOrder) {
  expect_sums_of_rows<std::int16_t>({19, 37, 4});
  expect_sums_of_rows<std::uint32_t>({8, 16, 3});
  expect_sums_of_rows<float>({5, 41, 2});
}

}  // namespace
}  // namespace tagrid
