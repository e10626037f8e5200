// A source whose bytes cost a wait, such as a file on a server: it is read in few and large parts, which are
// kept for a while.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"

namespace tagrid {

class ReadAhead : public ByteSource {
 public:
  /// Fills `to` with bytes from `position` on, or throws. Called by several threads at once, at most
  /// `most_at_once`.
  using Fetch = std::function<void(std::uint64_t position, std::span<std::byte> to)>;

  /// `beginning`: the first bytes of the source, which are known. `name` is for messages.
  ReadAhead(std::string name, std::uint64_t size, std::vector<std::byte> beginning, Fetch fetch);

  std::uint64_t size() const override { return size_; }
  const std::string& name() const override { return name_; }
  /// Waits while another thread fetches some of these bytes. What is read front to back is fetched in parts
  /// that become larger, up to largest_part. When a fetch fails, so do all reads that have begun; later
  /// ones fetch again, as a program that serves the source runs for hours.
  void read_at(std::uint64_t position, std::span<std::byte> to) const override;
  /// Ranges that lie close together are fetched as one, when the first byte of it is read. If there are few, so are
  /// those that lie further apart.
  void will_read(std::vector<ByteRange> ranges) const override;
  bool waits() const override { return true; }

  static constexpr std::size_t most_at_once = 8;
  static constexpr std::uint64_t largest_part = std::uint64_t{2} << 20;
  /// Bytes of the parts that are kept or being fetched.
  static constexpr std::uint64_t kept_bytes = most_at_once * largest_part;
  /// A gap of so many bytes is fetched sooner than a second answer arrives.
  static constexpr std::uint64_t largest_gap = std::uint64_t{64} << 10;
  /// A box across bricks along all axes is four ranges, or two for each layer of bricks. That few are made fewer if the
  /// gaps that are fetched for it have at most `most_in_gaps` bytes together.
  static constexpr std::size_t few_ranges = 4;
  static constexpr std::uint64_t most_in_gaps = std::uint64_t{1} << 20;

 private:
  struct Part {
    ByteRange range;
    std::vector<std::byte> bytes;
    bool is_there = false;  ///< false while a thread fetches it
  };
  using Parts = std::list<Part>;

  Parts::iterator part_at(std::uint64_t position) const;
  ByteRange range_to_fetch(std::uint64_t position, std::uint64_t size) const;
  void make_room(std::uint64_t bytes) const;
  void fetch_part(std::unique_lock<std::mutex>& lock, const ByteRange& range) const;
  void fetch_all(std::unique_lock<std::mutex>& lock, std::uint64_t position, std::span<std::byte> to) const;
  template <class Work>
  void while_others_wait(std::unique_lock<std::mutex>& lock, Work work) const;

  std::string name_;
  std::uint64_t size_;
  Fetch fetch_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  mutable Parts parts_;                  ///< the one that was used last is first
  mutable std::vector<ByteRange> plan_;  ///< in order, without overlaps
  mutable std::size_t fetching_ = 0;     ///< threads that do
  mutable std::size_t failures_ = 0;     ///< of fetches
  mutable std::exception_ptr failure_;   ///< the last one
};

}  // namespace tagrid
