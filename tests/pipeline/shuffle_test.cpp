// Bricks that finish in any order are written in their own order, with the same bytes.
#include <gtest/gtest.h>

#include <chrono>
#include <mutex>
#include <thread>

#include "pipeline/decode/graph.h"
#include "pipeline/encode/graph.h"
#include "tests/support/graph_ends.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr int threads = 7;

/// Makes every brick wait for a time that depends on the seed, and records the order in which they continue.
class Shuffle {
 public:
  explicit Shuffle(unsigned seed) : random_(seed) {}

  void operator()(std::int64_t brick) {
    int wait;
    {
      const std::lock_guard lock(mutex_);
      wait = static_cast<int>(random_() % 6);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(wait));
    const std::lock_guard lock(mutex_);
    order_.push_back(brick);
  }
  bool in_order() const { return std::is_sorted(order_.begin(), order_.end()); }
  std::size_t count() const { return order_.size(); }

 private:
  std::mutex mutex_;
  std::mt19937 random_;
  std::vector<std::int64_t> order_;
};

using Bricks = std::vector<BrickBytes>;

Bricks encoded(const CodingParameters& parameters, int thread_count, Shuffle* shuffle) {
  const std::vector<std::int16_t> samples = blobs<std::int16_t>(parameters.dims, 1);
  Bricks bricks;
  auto slices = slices_of(parameters.dims, samples);
  BricksInto sink([&](const BrickBytes& brick, const Statistics&) { bricks.push_back(brick); });
  WatchBricks watch([&](std::int64_t brick) {
    if (shuffle != nullptr) (*shuffle)(brick);
  });
  encode(job_of(parameters, thread_count), BrickRows::all(parameters.bricks()), slices, sink, watch);
  return bricks;
}

class GivenBricks : public BrickSource {
 public:
  explicit GivenBricks(const Bricks& bricks) : bricks_(bricks) {}
  const std::string& name() const override { return name_; }
  bool read_brick(BrickBytes& brick) override {
    if (next_ == bricks_.size()) return false;
    brick = bricks_[next_++];
    return true;
  }

 private:
  const Bricks& bricks_;
  std::size_t next_ = 0;
  std::string name_;
};

std::vector<std::byte> decoded(const CodingParameters& parameters, const Bricks& bricks, int thread_count,
                               Shuffle* shuffle) {
  std::vector<std::byte> samples;
  GivenBricks source(bricks);
  RowsTo sink([&](const DecodedRows& rows) {
    rows.for_each_part([&](std::int64_t, std::span<const std::byte> slices) {
      samples.insert(samples.end(), slices.begin(), slices.end());
    });
  });
  WatchBricks watch([&](std::int64_t brick) {
    if (shuffle != nullptr) (*shuffle)(brick);
  });
  decode(decode_job_of(parameters, thread_count), source, sink, watch);
  return samples;
}

bool same(const Bricks& a, const Bricks& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const BrickBytes& x, const BrickBytes& y) {
    return x.id == y.id && x.activity == y.activity && x.values == y.values;
  });
}

class Shuffled : public testing::TestWithParam<FileMode> {};

TEST_P(Shuffled, BricksAreTheSameInWhateverOrderTheyFinish) {
  const CodingParameters parameters = parameters_of_many_bricks(1, GetParam());
  const Bricks expected = encoded(parameters, 1, nullptr);
  const std::vector<std::byte> samples = decoded(parameters, expected, 1, nullptr);
  for (unsigned seed = 0; seed < 5; ++seed) {
    Shuffle encoding(seed), decoding(seed);
    EXPECT_TRUE(same(encoded(parameters, threads, &encoding), expected)) << seed;
    EXPECT_TRUE(decoded(parameters, expected, threads, &decoding) == samples) << seed;
    EXPECT_EQ(encoding.count(), expected.size());
    EXPECT_EQ(decoding.count(), expected.size());
    EXPECT_FALSE(encoding.in_order()) << "nothing is tested";
    EXPECT_FALSE(decoding.in_order()) << "nothing is tested";
  }
}

INSTANTIATE_TEST_SUITE_P(Mode, Shuffled, testing::Values(FileMode::voxels, FileMode::grid),
                         [](const auto& test) { return test.param == FileMode::grid ? "grid" : "voxels"; });

}  // namespace
}  // namespace tagrid
