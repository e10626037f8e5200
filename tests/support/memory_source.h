// A .tag file in memory that records which parts are read.
#pragma once

#include <algorithm>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "io/files/byte_source.h"

namespace tagrid {

class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::string bytes) : bytes_(std::move(bytes)) {}

  std::uint64_t size() const override { return bytes_.size(); }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    const std::lock_guard lock(mutex_);
    reads_.emplace_back(position, position + to.size());
    std::memcpy(to.data(), bytes_.data() + position, to.size());
  }
  const std::string& name() const override { return name_; }

  /// For every read since the last call: from its first byte to the byte after its last one.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> reads() const {
    const std::lock_guard lock(mutex_);
    return std::exchange(reads_, {});
  }

 private:
  std::string bytes_, name_ = "memory";
  mutable std::mutex mutex_;
  mutable std::vector<std::pair<std::uint64_t, std::uint64_t>> reads_;
};

}  // namespace tagrid
