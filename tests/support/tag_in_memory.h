// A .tag file in memory: its frames, the part that decoding needs, and a source that records which parts are
// read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/tag/bricks.h"

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

/// Header, bricks and pages of a .tag file with these bytes. They do not depend on where the samples came from: from
/// which file, or from a pipe. The rest of a file has the names and other bytes of the source files.
inline std::string header_and_bricks(const std::string& tag) {
  const TagBricks file(std::make_shared<MemorySource>(tag));
  return tag.substr(0, file.end_of_pages());
}

/// The frames of the bricks of a file, as offset and size.
inline std::vector<std::pair<std::size_t, std::size_t>> frames(const std::string& file) {
  const auto u32 = [&](std::size_t at) {
    std::uint32_t v;
    std::memcpy(&v, file.data() + at, 4);
    return v;
  };
  std::vector<std::pair<std::size_t, std::size_t>> result;
  for (std::size_t at = u32(12); u32(at) != 0;) {
    if (u32(at) < 4) {  // a block of a page, or of the envelope
      at += packed_frame_size + u32(at + 8);
      continue;
    }
    result.emplace_back(at, 4 + u32(at) + 8);
    at += result.back().second;
  }
  return result;
}

inline std::string frame_of(const std::string& file, std::size_t brick) {
  const auto [start, size] = frames(file)[brick];
  return file.substr(start, size);
}

/// The file with other bytes in place of the frames of the bricks first .. last.
inline std::string with_bricks(const std::string& file, std::size_t first, std::size_t last,
                               const std::string& bricks) {
  const auto all = frames(file);
  return file.substr(0, all[first].first) + bricks + file.substr(all[last].first + all[last].second);
}

/// The bytes with other bits in one place.
inline std::string flipped(std::string bytes, std::size_t at, int bits = 1) {
  bytes[at] = static_cast<char>(bytes[at] ^ bits);
  return bytes;
}

}  // namespace tagrid
