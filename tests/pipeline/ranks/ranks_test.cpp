// Work that is shared out: every item once, and one failure for all.
#include "pipeline/ranks/ranks.h"

#include <gtest/gtest.h>

#include <new>
#include <set>

#include "io/errors/errors.h"
#include "tests/support/fake_ranks.h"

namespace tagrid {
namespace {

void wait_for(const std::atomic<bool>& flag) {
  while (!flag) std::this_thread::yield();
}

/// The exceptions of share_out() on each rank, if `work` is the work of all of them. No item is started
/// before every rank has one.
std::vector<std::string> failures_of(int count, const std::function<void(int rank, SharedWork&)>& work) {
  FakeRanks all(count);
  std::vector<std::string> said(static_cast<std::size_t>(count));
  std::atomic<int> begun{0};
  all.run([&](Ranks& ranks) {
    SharedWork shared;
    shared.count = count;
    shared.work = [&](std::int64_t) {
      for (++begun; begun < count;) std::this_thread::yield();
      work(ranks.rank(), shared);
    };
    try {
      share_out(ranks, shared);
    } catch (const std::exception& error) {
      said[static_cast<std::size_t>(ranks.rank())] = error.what();
    }
  });
  return said;
}

TEST(Ranks, EveryItemIsDoneOnceAndRankZeroIsToldOfEach) {
  for (const int count : {1, 2, 5}) {
    FakeRanks all(count);
    std::multiset<std::int64_t> told;
    std::atomic<std::int64_t> done{0};
    all.run([&](Ranks& ranks) {
      SharedWork shared;
      shared.count = 100;
      shared.work = [&](std::int64_t item) {
        shared.account = Bytes(static_cast<std::size_t>(item) + 1);
        shared.add_done(item);
        ++done;
      };
      shared.take = [&](const Bytes& account) {
        EXPECT_EQ(ranks.rank(), 0);
        told.insert(static_cast<std::int64_t>(account.size()) - 1);
      };
      share_out(ranks, shared);
      // All items are done on every rank: later code may rely on them.
      EXPECT_EQ(done, 100);
      EXPECT_TRUE(count == 1 || ranks.add({}).done == 4950);
    });
    ASSERT_EQ(told.size(), 100U);
    std::int64_t next = 0;
    for (const std::int64_t item : told) EXPECT_EQ(item, next++);
  }
}

template <class Thrown, class Expected>
void expect_on_all_ranks(const Thrown& thrown, const std::string& what) {
  FakeRanks all(3);
  std::atomic<int> caught{0};
  all.run([&](Ranks& ranks) {
    try {
      all_do(ranks, [&] {
        if (ranks.rank() == 1) throw thrown;
      });
    } catch (const Expected& error) {
      EXPECT_EQ(typeid(error), typeid(Expected));
      EXPECT_TRUE(what.empty() || error.what() == what) << error.what();
      ++caught;
    }
  });
  EXPECT_EQ(caught, 3) << typeid(Thrown).name();
}

TEST(Ranks, AFailureOfOneIsThrownOnAllAsTheSameKind) {
  expect_on_all_ranks<UsageError, UsageError>(UsageError("x"), "rank 1: x");
  expect_on_all_ranks<BrokenInput, BrokenInput>(BrokenInput("x"), "rank 1: x");
  expect_on_all_ranks<WorldError, WorldError>(WorldError("x"), "rank 1: x");
  expect_on_all_ranks<ClosedPipe, ClosedPipe>(ClosedPipe("x"), "rank 1: x");
  expect_on_all_ranks<std::logic_error, std::runtime_error>(std::logic_error("x"), "rank 1: x");
  expect_on_all_ranks<std::bad_alloc, std::bad_alloc>({}, "");
  // The same error as in one process: too little memory.
  expect_on_all_ranks<std::length_error, std::bad_alloc>(std::length_error("x"), "");
  expect_on_all_ranks<BrokenInput, BrokenInput>(BrokenInput(std::string(9999, 'x')),
                                                "rank 1: " + std::string(4000, 'x'));
}

TEST(Ranks, AFailureOfOneKeepsItsCodeAndValuesOnAll) {
  FakeRanks all(3);
  std::atomic<int> caught{0};
  all.run([&](Ranks& ranks) {
    try {
      all_do(ranks, [&] {
        if (ranks.rank() == 1)
          throw UsageError(Sentence{"{} must be {}", {Setting{"cube", "the edge"}, 32}},
                           Problem::output_exists);
      });
    } catch (const UsageError& error) {
      EXPECT_STREQ(error.what(), "rank 1: the edge must be 32");
      EXPECT_EQ(error.detail().problem, Problem::output_exists);
      EXPECT_EQ(error.detail().context + text_of(error.detail().sentence, "--"), "rank 1: --cube must be 32");
      ++caught;
    }
    try {
      all_do(ranks, [&] {
        if (ranks.rank() == 2) throw MemoryLimit("decoding", 1, 3'000'000'001, 2);
      });
    } catch (const MemoryLimit& limit) {
      EXPECT_EQ(limit.needed(), 3'000'000'001U);
      EXPECT_EQ(limit.needed_with_spool(), 2U);
      ++caught;
    }
  });
  EXPECT_EQ(caught, 6);
}

TEST(Ranks, TheFirstRankThatFailedIsTheOneThatIsTold) {
  FakeRanks all(4);
  all.run([&](Ranks& ranks) {
    try {
      agree(ranks, ranks.rank() == 0   ? std::make_exception_ptr(Stopped{})
                   : ranks.rank() == 1 ? nullptr
                                       : std::make_exception_ptr(WorldError(std::to_string(ranks.rank()))));
      ADD_FAILURE();
    } catch (const WorldError& error) {
      EXPECT_STREQ(error.what(), "rank 2: 2");
    }
  });
}

TEST(Ranks, ThoseThatStillWorkAreToldToStop) {
  const auto said = failures_of(3, [](int rank, SharedWork& shared) {
    if (rank == 2) throw WorldError("the disk is full");
    wait_for(shared.stop);
    throw Stopped();
  });
  EXPECT_EQ(said, std::vector<std::string>(3, "rank 2: the disk is full"));
}

TEST(Ranks, ALookThatThrowsStopsTheWorkAndIsThrownOnAllRanks) {
  FakeRanks all(2);
  std::atomic<int> caught{0}, begun{0};
  all.run([&](Ranks& ranks) {
    SharedWork shared;
    shared.count = 2;
    shared.work = [&](std::int64_t) {
      for (++begun; begun < 2;) std::this_thread::yield();
      wait_for(shared.stop);
      throw Stopped();
    };
    shared.look = [&](const SharedNumbers&) {
      if (ranks.rank() == 1) throw WorldError("nobody can be told");
    };
    try {
      share_out(ranks, shared);
    } catch (const WorldError& error) {
      EXPECT_STREQ(error.what(), "rank 1: nobody can be told");
      ++caught;
    }
  });
  EXPECT_EQ(caught, 2);
}

TEST(Ranks, AttendingWaitsForTheWorkAlsoWhenALookThrows) {
  FakeRanks all(2);
  all.run([&](Ranks& ranks) {
    std::atomic<bool> looked{false};
    bool ended = false;
    const auto work = [&] {
      wait_for(looked);
      ended = true;
      throw WorldError("of the work");
    };
    const auto look = [&] {
      EXPECT_FALSE(looked) << "it is not called again";
      looked = true;
      throw BrokenInput("of the look");
    };
    EXPECT_THROW(ranks.attend(work, look), BrokenInput);
    EXPECT_TRUE(ended);
  });
}

TEST(Ranks, OneProcessWorksInTheThreadThatAsksAndIsToldWhatItHasDone) {
  SharedWork shared;
  const auto here = std::this_thread::get_id();
  std::vector<std::int64_t> done;
  shared.count = 3;
  shared.work = [&](std::int64_t item) {
    EXPECT_EQ(std::this_thread::get_id(), here);
    shared.add_done(item + 1);
    EXPECT_EQ(done.size(), static_cast<std::size_t>(item) + 1) << "at once";
  };
  shared.look = [&](const SharedNumbers& numbers) { done.push_back(numbers.done); };
  Ranks alone;
  share_out(alone, shared);
  EXPECT_EQ(done, (std::vector<std::int64_t>{1, 3, 6}));
}

TEST(Ranks, OneProcessThrowsWhatItsWorkThrewAndDoesNoMore) {
  SharedWork shared;
  int begun = 0;
  shared.count = 3;
  shared.work = [&](std::int64_t) {
    ++begun;
    throw std::out_of_range("x");
  };
  Ranks alone;
  EXPECT_THROW(share_out(alone, shared), std::out_of_range);
  EXPECT_EQ(begun, 1);
}

}  // namespace
}  // namespace tagrid
