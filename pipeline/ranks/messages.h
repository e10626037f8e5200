// Converts messages between ranks to and from bytes: the same walk over a value writes it and reads it.
//
// A struct is sent with all of its members. TAGRID_MEMBERS lists them, and does not compile with fewer or
// more names than the struct has members. So a new member cannot be forgotten.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/bytes/byte_fields.h"
#include "stages/sample/statistics.h"

namespace tagrid {

/// Names all members of a struct, in their order, for walk(). Its place is the namespace of the struct:
/// beside it, or in order_members.h.
#define TAGRID_MEMBERS(Struct, ...)                      \
  template <class Of>                                    \
  requires std::same_as<std::remove_const_t<Of>, Struct> \
  auto members_of(Of& of) {                              \
    auto& [__VA_ARGS__] = of;                            \
    return std::tie(__VA_ARGS__);                        \
  }

class OrderWriter {
 public:
  static constexpr bool reads = false;
  template <class Number>
  void number(const Number& number) {
    fields_.put(number);
  }
  void bytes(std::span<const std::byte> bytes) { fields_.put_bytes(bytes); }
  std::size_t size(std::size_t size) {
    fields_.put(static_cast<std::uint64_t>(size));
    return size;
  }
  std::vector<std::byte>& result() { return fields_.bytes(); }

 private:
  FieldWriter fields_;
};

class OrderReader {
 public:
  static constexpr bool reads = true;
  explicit OrderReader(std::span<const std::byte> bytes) : fields_(bytes) {}
  template <class Number>
  void number(Number& number) {
    number = fields_.get<Number>();
  }
  void bytes(std::span<std::byte> to) {
    const auto from = fields_.get_bytes(to.size());
    std::copy(from.begin(), from.end(), to.begin());
  }
  /// The size of a list, each of whose elements takes at least one byte.
  std::size_t size(std::size_t) {
    const auto size = fields_.get<std::uint64_t>();
    if (size > fields_.left()) fail();
    return size;
  }
  void finish() const {
    if (!fields_.complete()) fail();
  }

 private:
  [[noreturn]] static void fail() { throw std::logic_error("what another rank sent cannot be read"); }

  FieldReader fields_;
};

namespace order_fields {

template <template <class...> class Template, class Type>
inline constexpr bool is_a = false;
template <template <class...> class Template, class... Arguments>
inline constexpr bool is_a<Template, Template<Arguments...>> = true;

template <class Type>
inline constexpr bool is_array = false;
template <class Type, std::size_t size>
inline constexpr bool is_array<std::array<Type, size>> = true;

template <class Type>
inline constexpr bool is_bytes =
    std::is_same_v<Type, std::string> || std::is_same_v<Type, std::vector<std::byte>>;

}  // namespace order_fields

/// Writes `value`, which is const, with an OrderWriter, or reads it with an OrderReader. Values are numbers,
/// enumerations, text, bytes, optional values, arrays, lists, maps, and structs of these.
template <class Fields, class Value>
void walk(Fields& fields, Value& value) {
  using Plain = std::remove_const_t<Value>;
  using namespace order_fields;
  // Sends a replacement of the value; when reading, makes the value from the replacement.
  [[maybe_unused]] const auto as = [&](auto sent, auto made_of) {
    walk(fields, sent);
    if constexpr (Fields::reads) value = made_of(sent);
  };
  if constexpr (std::is_same_v<Plain, bool>) {
    as(static_cast<std::uint8_t>(value), [](std::uint8_t truth) { return truth != 0; });
  } else if constexpr (std::is_same_v<Plain, Uint128>) {
    as(std::array{static_cast<std::uint64_t>(value), static_cast<std::uint64_t>(value >> 64)},
       [](const std::array<std::uint64_t, 2>& halves) { return Uint128{halves[1]} << 64 | halves[0]; });
  } else if constexpr (std::is_enum_v<Plain>) {
    using Number = std::underlying_type_t<Plain>;
    as(static_cast<Number>(value), [](Number number) { return static_cast<Plain>(number); });
  } else if constexpr (std::is_arithmetic_v<Plain>) {
    fields.number(value);
  } else if constexpr (is_bytes<Plain>) {
    const std::size_t size = fields.size(value.size());
    if constexpr (Fields::reads) {
      value.resize(size);
      fields.bytes(std::as_writable_bytes(std::span(value)));
    } else {
      fields.bytes(std::as_bytes(std::span(value)));
    }
  } else if constexpr (is_a<std::optional, Plain>) {
    bool present = value.has_value();
    walk(fields, present);
    if constexpr (Fields::reads) present ? void(value.emplace()) : value.reset();
    if (present) walk(fields, *value);
  } else if constexpr (is_a<std::vector, Plain>) {
    const std::size_t size = fields.size(value.size());
    if constexpr (Fields::reads) value.resize(size);
    for (auto& element : value) walk(fields, element);
  } else if constexpr (is_a<std::map, Plain>) {
    as(std::vector<std::pair<typename Plain::key_type, typename Plain::mapped_type>>(value.begin(),
                                                                                     value.end()),
       [](const auto& pairs) { return Plain(pairs.begin(), pairs.end()); });
  } else if constexpr (order_fields::is_array<Plain>) {
    for (auto& element : value) walk(fields, element);
  } else if constexpr (is_a<std::pair, Plain>) {
    walk(fields, value.first);
    walk(fields, value.second);
  } else {
    std::apply([&](auto&... member) { (walk(fields, member), ...); }, members_of(value));
  }
}

/// `order` as bytes.
template <class Order>
std::vector<std::byte> packed_order(const Order& order) {
  OrderWriter writer;
  walk(writer, order);
  return std::move(writer.result());
}

/// The order that takes up all of `bytes`, which another rank packed. Throws std::logic_error if there is
/// none.
template <class Order>
Order unpacked_order(std::span<const std::byte> bytes) {
  Order order;
  OrderReader reader(bytes);
  walk(reader, order);
  reader.finish();
  return order;
}

}  // namespace tagrid
