// Builds the metadata of an OpenVDB grid.
#pragma once

#include <cstdint>
#include <string_view>

#include "io/bytes/byte_fields.h"
#include "stages/grid/box.h"

namespace tagrid {

/// Named values. The library writes them in the order of their names; callers should add them in this order.
class VdbMetadata {
 public:
  void add(std::string_view name, std::string_view text);
  void add(std::string_view name, const Index3& vector);
  void add(std::string_view name, double number);
  void add(std::string_view name, std::int64_t number);

  void put_to(FieldWriter& out) const;

 private:
  void add_name(std::string_view name, std::string_view type);
  template <class T>
  void add_number(std::string_view name, std::string_view type, T number);

  std::uint32_t count_ = 0;
  FieldWriter entries_;
};

}  // namespace tagrid
