#include "io/http/read_ahead.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>
#include <numeric>
#include <thread>

#include "io/errors/errors.h"

namespace tagrid {
namespace {

/// Bytes that say where they are, behind a ReadAhead that counts what it fetches.
class Far {
 public:
  explicit Far(std::size_t size, std::size_t beginning = 100) : bytes_(size) {
    // Tests are not optimized: a number at a time.
    for (std::size_t i = 0; i + 8 <= size; i += 8) {
      const std::uint64_t number = i * 0x9E3779B97F4A7C15u;
      std::memcpy(bytes_.data() + i, &number, 8);
    }
    source_ = std::make_unique<ReadAhead>(
        "far", size, std::vector(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(beginning)),
        [this](std::uint64_t position, std::span<std::byte> to) { fetch(position, to); });
  }
  const ReadAhead& source() const { return *source_; }
  std::vector<std::byte> read(std::uint64_t position, std::size_t size) const {
    std::vector<std::byte> to(size);
    source_->read_at(position, to);
    return to;
  }
  bool is_right(std::uint64_t position, std::size_t size) const {
    return std::memcmp(read(position, size).data(), bytes_.data() + position, size) == 0;
  }
  std::vector<ByteRange> fetched;
  std::size_t most_at_once = 0;
  std::atomic<bool> fails = false;

 private:
  void fetch(std::uint64_t position, std::span<std::byte> to) {
    {
      const std::lock_guard lock(mutex_);
      fetched.push_back({position, position + to.size()});
      most_at_once = std::max(most_at_once, ++at_once_);
    }
    std::this_thread::yield();
    if (fails) throw WorldError("far: is gone");
    std::memcpy(to.data(), bytes_.data() + position, to.size());
    const std::lock_guard lock(mutex_);
    --at_once_;
  }

  std::vector<std::byte> bytes_;
  std::unique_ptr<ReadAhead> source_;
  std::mutex mutex_;
  std::size_t at_once_ = 0;
};

constexpr std::size_t mebibyte = std::size_t{1} << 20;

RC_GTEST_PROP(ReadAhead, GivesTheBytesOfAnyRead, ()) {
  const auto size = *rc::gen::inRange<std::size_t>(100, 8 * mebibyte);
  Far far(size, *rc::gen::inRange<std::size_t>(0, 100));
  for (int i = 0; i < 20; ++i) {
    const auto position = *rc::gen::inRange<std::size_t>(0, size);
    const auto count = *rc::gen::inRange<std::size_t>(0, size - position + 1);
    if (*rc::gen::inRange(0, 3) == 0) {
      const auto middle = position + count / 2;
      far.source().will_read({{middle, position + count}, {position, middle}});
    }
    RC_ASSERT(far.is_right(position, count));
  }
  for (const ByteRange& range : far.fetched) RC_ASSERT(range.size() <= ReadAhead::largest_part);
}

TEST(ReadAhead, WhatIsReadFrontToBackComesInGrowingParts) {
  Far far(40 * mebibyte);
  for (std::size_t at = 0; at < 40 * mebibyte; at += 4096) ASSERT_TRUE(far.is_right(at, 4096));
  EXPECT_LT(far.fetched.size(), 40u);
  for (std::size_t i = 1; i + 1 < far.fetched.size(); ++i) {
    EXPECT_EQ(far.fetched[i].begin, far.fetched[i - 1].end);
    EXPECT_EQ(far.fetched[i].size(),
              std::min<std::uint64_t>(2 * far.fetched[i - 1].size(), ReadAhead::largest_part));
  }
}

TEST(ReadAhead, OneReadElsewhereFetchesLittleMore) {
  Far far(40 * mebibyte);
  EXPECT_TRUE(far.is_right(20 * mebibyte, 10));
  EXPECT_TRUE(far.is_right(20 * mebibyte + 10, 1000));
  EXPECT_TRUE(far.is_right(0, 100));
  ASSERT_EQ(far.fetched.size(), 1u);
  EXPECT_EQ(far.fetched[0].size(), std::size_t{16} << 10);
  EXPECT_TRUE(far.is_right(30 * mebibyte, 100000));
  ASSERT_EQ(far.fetched.size(), 2u);
  EXPECT_EQ(far.fetched[1].size(), 100000u);
}

TEST(ReadAhead, PlannedRangesAreFetchedTogetherIfTheGapIsSmall) {
  Far far(40 * mebibyte);
  const std::uint64_t gap = ReadAhead::largest_gap;
  const std::uint64_t a = mebibyte, b = a + 50000 + gap, c = b + 50000 + ReadAhead::most_in_gaps + 1;
  far.source().will_read({{c, c + 50000}, {a, a + 50000}, {b, b + 50000}});
  EXPECT_TRUE(far.is_right(a, 50000));
  EXPECT_TRUE(far.is_right(b, 50000));
  ASSERT_EQ(far.fetched.size(), 1u);
  EXPECT_EQ(far.fetched[0].end, b + 50000);
  EXPECT_TRUE(far.is_right(c, 50000));
  ASSERT_EQ(far.fetched.size(), 2u);
  EXPECT_EQ(far.fetched[1].begin, c);
}

// Rows of bricks around a corner, whose layers lie far apart.
TEST(ReadAhead, FewRangesBecomeFewer) {
  Far far(40 * mebibyte);
  const std::uint64_t rows = mebibyte / 2, layers = 20 * mebibyte;
  const auto places = {mebibyte, mebibyte + rows, layers, layers + rows};
  std::vector<ByteRange> plan;
  for (const std::uint64_t at : places) plan.push_back({at, at + 100});
  far.source().will_read(plan);
  for (const std::uint64_t at : places) EXPECT_TRUE(far.is_right(at, 100));
  ASSERT_EQ(far.fetched.size(), 2u);
  EXPECT_EQ(far.fetched[1].begin, layers);
  EXPECT_EQ(far.fetched[1].end, layers + rows + 100);
}

TEST(ReadAhead, NoMoreIsKeptThanWasPromised) {
  Far far(64 * mebibyte);
  const auto pass = [&] {
    far.fetched.clear();
    for (std::size_t at = 0; at < 64 * mebibyte; at += mebibyte) ASSERT_TRUE(far.is_right(at, mebibyte));
  };
  pass();
  const std::size_t first = far.fetched.size();
  pass();
  // All but what was kept is fetched again.
  const auto sum =
      std::accumulate(far.fetched.begin(), far.fetched.end(), std::uint64_t{0},
                      [](std::uint64_t bytes, const ByteRange& range) { return bytes + range.size(); });
  EXPECT_GE(sum, 64 * mebibyte - ReadAhead::kept_bytes);
  EXPECT_LE(far.fetched.size(), 2 * first);
}

TEST(ReadAhead, ThreadsFetchNothingTwice) {
  Far far(12 * mebibyte);
  std::atomic<bool> is_right = true;
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 16; ++t)
    threads.emplace_back([&, t] {
      for (std::size_t i = 0; i < 60; ++i)
        if (!far.is_right((i * 7 + t / 2 * 15) % 60 * 200000, 100000)) is_right = false;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(is_right);
  EXPECT_LE(far.most_at_once, ReadAhead::most_at_once);
  std::ranges::sort(far.fetched, {}, &ByteRange::begin);
  for (std::size_t i = 1; i < far.fetched.size(); ++i)
    EXPECT_LE(far.fetched[i - 1].end, far.fetched[i].begin);
}

TEST(ReadAhead, AFailureIsThatOfAllReadsThatHaveBegunAndOfNoLaterOne) {
  Far far(12 * mebibyte);
  far.fails = true;
  std::atomic<int> failed = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t)
    threads.emplace_back([&] {
      try {
        far.read(5 * mebibyte, 1000);
      } catch (const WorldError&) {
        ++failed;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failed, 8);
  EXPECT_LE(far.fetched.size(), 8u);
  EXPECT_THROW(far.read(9 * mebibyte, 1000), WorldError);
  far.fails = false;
  EXPECT_TRUE(far.is_right(9 * mebibyte, 1000));
  EXPECT_TRUE(far.is_right(5 * mebibyte, 1000));
}

}  // namespace
}  // namespace tagrid
