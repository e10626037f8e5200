// Orders between ranks: every member of a struct arrives, and bytes that are not an order are refused.
#include "pipeline/ranks/messages.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "pipeline/parts/order_members.h"

namespace tagrid {
namespace {

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
