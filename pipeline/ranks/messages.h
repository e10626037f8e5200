// What ranks send each other, as bytes: one description of it serves both directions.
//
// A description is a function describe(fields, order) that calls fields(member) for every member, in the same
// order, with OrderWriter or OrderReader as fields.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "io/bytes/byte_fields.h"

namespace tagrid {

class OrderWriter {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void operator()(const Number& number) { fields_.put(number); }
  void operator()(const bool& truth) { fields_.put(static_cast<std::uint8_t>(truth)); }
  void operator()(const std::string& text) {
    size_of_list(text.size());
    fields_.put_bytes(std::as_bytes(std::span(text)));
  }
  void operator()(const std::vector<std::byte>& bytes) {
    size_of_list(bytes.size());
    fields_.put_bytes(bytes);
  }
  template <class T>
  std::size_t size(const std::vector<T>& list) {
    size_of_list(list.size());
    return list.size();
  }
  template <class T>
  bool present(const std::optional<T>& value) {
    fields_.put(static_cast<std::uint8_t>(value.has_value()));
    return value.has_value();
  }
  std::vector<std::byte>& bytes() { return fields_.bytes(); }

 private:
  void size_of_list(std::size_t size) { fields_.put(static_cast<std::uint64_t>(size)); }

  FieldWriter fields_;
};

class OrderReader {
 public:
  explicit OrderReader(FieldReader& fields) : fields_(fields) {}
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void operator()(Number& number) { number = fields_.get<Number>(); }
  void operator()(bool& truth) { truth = fields_.get<std::uint8_t>() != 0; }
  void operator()(std::string& text) {
    const auto bytes = fields_.get_bytes(fields_.get<std::uint64_t>());
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void operator()(std::vector<std::byte>& to) {
    const auto bytes = fields_.get_bytes(fields_.get<std::uint64_t>());
    to.assign(bytes.begin(), bytes.end());
  }
  template <class T>
  std::size_t size(std::vector<T>& list) {
    list.resize(fields_.get<std::uint64_t>());
    return list.size();
  }
  template <class T>
  bool present(std::optional<T>& value) {
    if (fields_.get<std::uint8_t>() == 0) return false;
    value.emplace();
    return true;
  }

 private:
  FieldReader& fields_;
};

/// `order` as bytes.
template <class Order>
std::vector<std::byte> packed_order(const Order& order) {
  OrderWriter writer;
  describe(writer, order);
  return std::move(writer.bytes());
}

/// The order that is in all of `bytes`, which another rank packed.
template <class Order>
Order unpacked_order(std::span<const std::byte> bytes) {
  Order order;
  FieldReader fields(bytes);
  OrderReader reader(fields);
  describe(reader, order);
  if (!fields.complete()) throw std::logic_error("what another rank sent cannot be read");
  return order;
}

}  // namespace tagrid
