// Little-endian numbers, one after the other in bytes.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "io/bytes/little_endian.h"

namespace tagrid {

class FieldWriter {
 public:
  template <class T>
  void put(T value) {
    std::array<std::byte, sizeof(T)> field;
    store_little_endian(field.data(), value);
    for (const std::byte byte : field) bytes_.push_back(byte);
  }
  void put_bytes(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte>& bytes() { return bytes_; }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads what FieldWriter wrote. Past the end it returns zeros, and complete() is false.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  T get() {
    if (sizeof(T) > left()) {
      overrun_ = true;
      position_ = bytes_.size();
      return T{};
    }
    position_ += sizeof(T);
    return load_little_endian<T>(bytes_.data() + position_ - sizeof(T));
  }
  std::span<const std::byte> get_bytes(std::size_t size) {
    if (size > left()) {
      overrun_ = true;
      position_ = bytes_.size();
      return {};
    }
    position_ += size;
    return bytes_.subspan(position_ - size, size);
  }
  std::size_t left() const { return bytes_.size() - position_; }
  /// True if exactly all bytes were read.
  bool complete() const { return !overrun_ && left() == 0; }
  bool overrun() const { return overrun_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  bool overrun_ = false;
};

}  // namespace tagrid
