// Work that is shared out: every item once, and one failure for all.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <new>
#include <set>

#include "io/errors/errors.h"
#include "pipeline/parts/order_members.h"
#include "pipeline/ranks/messages.h"
#include "pipeline/ranks/ranks.h"
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
          throw UsageError(Sentence("{} must be {}", Setting{"cube", "the edge"}, 32),
                           Problem::output_exists);
      });
    } catch (const UsageError& error) {
      EXPECT_STREQ(error.what(), "rank 1: the edge must be 32");
      EXPECT_EQ(error.detail().problem, Problem::output_exists);
      EXPECT_EQ(error.detail().with_options, "rank 1: --cube must be 32");
      ++caught;
    }
    try {
      all_do(ranks, [&] {
        if (ranks.rank() == 2)
          throw MemoryLimit("decoding", {.needed = 3'000'000'001, .allowed = 1, .with_spool = 2});
      });
    } catch (const MemoryLimit& limit) {
      EXPECT_EQ(limit.needs().needed, 3'000'000'001U);
      EXPECT_EQ(limit.needs().with_spool, 2U);
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

// Orders between ranks: every member of a struct arrives, and bytes that are not an order are refused.

enum class Colour : std::uint16_t { red = 3, blue = 700 };

struct Inner {
  std::optional<std::array<double, 2>> pair;
  std::vector<std::string> names;
  bool operator==(const Inner&) const = default;
};
TAGRID_MEMBERS(Inner, pair, names)

struct Everything {
  bool truth = false;
  Colour colour = Colour::red;
  std::int8_t small = 0;
  double real = 0;
  Uint128 wide = 0;
  std::map<std::string, int> map;
  std::vector<Inner> list;
  std::vector<std::byte> bytes;
  std::optional<bool> maybe;
  bool operator==(const Everything&) const = default;
};
TAGRID_MEMBERS(Everything, truth, colour, small, real, wide, map, list, bytes, maybe)

/// Changes one number, letter or presence of each leaf of a value, one after the other, and calls use() with
/// each result.
template <class Value, class Use>
void change_each(Value& value, const Use& use) {
  using namespace order_fields;
  const auto with = [&](Value changed) {
    Value before = std::exchange(value, std::move(changed));
    use();
    value = std::move(before);
  };
  if constexpr (std::is_same_v<Value, bool>) {
    with(!value);
  } else if constexpr (std::is_enum_v<Value>) {
    with(static_cast<Value>(1 - static_cast<int>(value)));
  } else if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, Uint128>) {
    with(static_cast<Value>(value == 7 ? 8 : 7));
  } else if constexpr (std::is_same_v<Value, std::string>) {
    with(value + "x");
  } else if constexpr (std::is_same_v<Value, std::vector<std::byte>>) {
    with(Bytes{std::byte{1}, std::byte{2}});
  } else if constexpr (is_a<std::optional, Value>) {
    value.emplace();
    use();
    change_each(*value, use);
  } else if constexpr (is_a<std::vector, Value>) {
    value.resize(value.size() + 2);
    use();
    change_each(value.back(), use);
  } else if constexpr (order_fields::is_array<Value>) {
    for (auto& element : value) change_each(element, use);
  } else if constexpr (is_a<std::map, Value>) {
    Value more = value;
    more["some"];
    with(more);
  } else {
    std::apply([&](auto&... member) { (change_each(member, use), ...); }, members_of(value));
  }
}

/// Any change of any leaf changes the bytes, and is restored from them.
template <class Order>
int expect_that_all_of_it_is_sent(Order order = {}) {
  std::set<Bytes> seen = {packed_order(order)};
  int changes = 0;
  change_each(order, [&] {
    const Bytes bytes = packed_order(order);
    EXPECT_TRUE(seen.insert(bytes).second) << "a change of member " << changes << " is not sent";
    EXPECT_TRUE(packed_order(unpacked_order<Order>(bytes)) == bytes) << "change " << changes;
    ++changes;
  });
  return changes;
}

TEST(OrderFields, EveryMemberOfEveryOrderIsSent) {
  EXPECT_GT(expect_that_all_of_it_is_sent<PartOrder>(), 20);
  EXPECT_GT(expect_that_all_of_it_is_sent<PlaceOrder>(), 6);
  EXPECT_GT(expect_that_all_of_it_is_sent<DecodeOrder>(), 7);
  EXPECT_GT(expect_that_all_of_it_is_sent<VerifyOrder>(), 15);
  EXPECT_GT(expect_that_all_of_it_is_sent<Findings>(), 10);
  EXPECT_GT(expect_that_all_of_it_is_sent<Everything>(), 12);
}

TEST(OrderFields, ValuesOfEveryKindComeBack) {
  Everything all{true, Colour::blue, -5, -0.25, (Uint128{1} << 100) + 3, {{"a", -1}, {"", 2}}, {}, {}, false};
  all.list = {{std::array{1.5, -2.0}, {"one", "", std::string("\0x", 2)}}, {}};
  all.bytes = {std::byte{0}, std::byte{255}};
  EXPECT_TRUE(unpacked_order<Everything>(packed_order(all)) == all);
  EXPECT_TRUE(unpacked_order<Everything>(packed_order(Everything{})) == Everything{});
}

TEST(OrderFields, EveryPrefixAndEveryLongerOneOfAnOrderIsRefused) {
  VerifyOrder order;
  order.input = "a";
  order.source.raw = RawDescription{};
  Bytes bytes = packed_order(order);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(unpacked_order<VerifyOrder>(std::span(bytes).first(size)), std::logic_error) << size;
  bytes.push_back({});
  EXPECT_THROW(unpacked_order<VerifyOrder>(bytes), std::logic_error);
}

TEST(OrderFields, ASizeBeyondTheBytesTakesNoMemory) {
  const Bytes bytes(64, std::byte{0x7f});
  EXPECT_THROW(unpacked_order<PlaceOrder>(bytes), std::logic_error);
  EXPECT_THROW(unpacked_order<Findings>(Bytes(2000, std::byte{0xff})), std::logic_error);
}

RC_GTEST_PROP(OrderFields, AnyBytesAreAnOrderOrRefused, (const std::vector<std::uint8_t>& numbers)) {
  Bytes bytes;
  for (const std::uint8_t number : numbers) bytes.push_back(static_cast<std::byte>(number));
  try {
    unpacked_order<PartOrder>(bytes);
  } catch (const std::logic_error&) {
  }
}

}  // namespace
}  // namespace tagrid
