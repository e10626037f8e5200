// Converts messages between ranks to and from bytes: the same walk over a value writes it and reads it.
//
// A struct is sent with all of its members. TAGRID_MEMBERS lists them, and does not compile with fewer or
// more names than the struct has members. So a new member cannot be forgotten.
#pragma once

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

#include "io/bytes/little_endian.h"
#include "stages/sample/statistics.h"

namespace tagrid {

/// Names the members of a struct, in order, for walk(). Stands in its namespace, or in order_members.h.
#define TAGRID_MEMBERS(Struct, ...)                      \
  template <class Of>                                    \
  requires std::same_as<std::remove_const_t<Of>, Struct> \
  auto members_of(Of& of) {                              \
    auto& [__VA_ARGS__] = of;                            \
    return std::tie(__VA_ARGS__);                        \
  }

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

[[noreturn]] inline void fail() { throw std::logic_error("what another rank sent cannot be read"); }

// The size of a list, each of whose elements takes at least one byte.
inline std::size_t walk_size(FieldWriter& fields, std::size_t size) {
  fields.put(static_cast<std::uint64_t>(size));
  return size;
}
inline std::size_t walk_size(FieldReader& fields, std::size_t) {
  const auto size = fields.get<std::uint64_t>();
  if (size > fields.left()) fail();
  return size;
}

}  // namespace order_fields

/// Writes `value` with a FieldWriter, or reads it with a FieldReader. Values are numbers, enumerations, text,
/// bytes, optional values, arrays, lists, maps, and structs of these.
template <class Fields, class Value>
void walk(Fields& fields, Value& value) {
  using Plain = std::remove_const_t<Value>;
  using namespace order_fields;
  [[maybe_unused]] constexpr bool reads = std::is_same_v<Fields, FieldReader>;
  // Sends a replacement of the value; when reading, makes the value from the replacement.
  [[maybe_unused]] const auto as = [&](auto sent, auto made_of) {
    walk(fields, sent);
    if constexpr (reads) value = made_of(sent);
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
    if constexpr (reads)
      value = fields.template get<Plain>();
    else
      fields.put(value);
  } else if constexpr (is_bytes<Plain>) {
    const std::size_t size = walk_size(fields, value.size());
    if constexpr (reads) {
      const auto* first = reinterpret_cast<const typename Plain::value_type*>(fields.get_bytes(size).data());
      value.assign(first, first + size);
    } else {
      fields.put_bytes(std::as_bytes(std::span(value)));
    }
  } else if constexpr (is_a<std::optional, Plain>) {
    bool present = value.has_value();
    walk(fields, present);
    if constexpr (reads) present ? void(value.emplace()) : value.reset();
    if (present) walk(fields, *value);
  } else if constexpr (is_a<std::vector, Plain>) {
    const std::size_t size = walk_size(fields, value.size());
    if constexpr (reads) value.resize(size);
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
  FieldWriter writer;
  walk(writer, order);
  return std::move(writer.bytes());
}

/// The order that takes up all of `bytes`. Throws std::logic_error if there is none.
template <class Order>
Order unpacked_order(std::span<const std::byte> bytes) {
  Order order;
  FieldReader reader(bytes);
  walk(reader, order);
  if (!reader.complete()) order_fields::fail();
  return order;
}

}  // namespace tagrid
