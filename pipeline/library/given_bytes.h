// The bytes of a file that a caller of the library gives when it is told which ones are needed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "io/files/byte_source.h"
#include "tagrid/tagrid_blocks.h"

namespace tagrid::library {

/// Thrown by a read of bytes that were not given. It passes through everything that reads: the call is repeated when
/// the bytes are there.
struct BytesAreMissing {};

/// A source of given bytes. A read for which there are none is noted.
class GivenBytes : public ByteSource {
 public:
  explicit GivenBytes(std::uint64_t size) : size_(size) {}

  std::uint64_t size() const override { return size_; }
  const std::string& name() const override { return name_; }

  /// Throws BytesAreMissing unless one given part has all of these bytes.
  void expect(std::uint64_t position, std::uint64_t size) const override {
    if (has(position, size)) return;
    throw BytesAreMissing();
  }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    if (to.empty()) return;
    expect(position, to.size());
    const Part& part = *part_with(position, to.size());
    std::memcpy(to.data(), part.bytes.data() + (position - part.position), to.size());
  }
  /// False, and the range is noted as missing, unless it is there. REQUIRES: it is within the file.
  bool has(std::uint64_t position, std::uint64_t size) const {
    if (size == 0 || part_with(position, size) != nullptr) return true;
    const auto is_it = [&](const tagrid_range& r) { return r.offset == position && r.bytes == size; };
    if (std::none_of(missing_.begin(), missing_.end(), is_it)) missing_.push_back({position, size});
    return false;
  }

  void give(std::uint64_t position, std::span<const std::byte> bytes) {
    parts_.push_back({position, {bytes.begin(), bytes.end()}});
  }
  /// What a new call lacks is noted from now on.
  void begin() { missing_.clear(); }
  /// Drops the bytes.
  void forget() { parts_ = {}; }
  const std::vector<tagrid_range>& missing() const { return missing_; }

 private:
  struct Part {
    std::uint64_t position;
    std::vector<std::byte> bytes;
  };
  const Part* part_with(std::uint64_t position, std::uint64_t size) const {
    for (const Part& part : parts_)
      if (position >= part.position && part.bytes.size() >= size &&
          position - part.position <= part.bytes.size() - size)
        return &part;
    return nullptr;
  }

  std::uint64_t size_;
  std::string name_ = "the file";
  std::vector<Part> parts_;
  mutable std::vector<tagrid_range> missing_;
};

}  // namespace tagrid::library
