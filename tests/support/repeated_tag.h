// A file of any size whose bricks all have the same code. Its bytes are made when they are read.
#pragma once

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/tag/file.h"
#include "io/tag/members.h"
#include "tests/support/forged_index.h"

namespace tagrid {

/// Keeps what is written.
struct KeptBytes : ByteSink {
  void write(std::span<const std::byte> bytes) override {
    all.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  std::string all;
};

/// The bytes of a file whose bricks all have this code, written as any other file.
inline std::string file_of_equal_bricks(const TagHeader& header, const BrickBytes& code) {
  KeptBytes sink;
  TagWriter writer(sink, header);
  for (std::int64_t id = 0; id < header.parameters.bricks().count(); ++id)
    writer.write_brick({id, code.activity, code.values}, {});
  writer.finish();
  return std::move(sink.all);
}

/// A file of a volume that is far too large to be made, and its overviews, which are there. The last brick of
/// each row along x has a wrong checksum, so that no other one depends on all bricks before it. REQUIRES:
/// pages have complete rows.
class RepeatedTag : public ByteSource {
 public:
  struct Overview {
    std::uint32_t factor;
    std::string bytes;
  };

  RepeatedTag(const TagHeader& header, BrickBytes code, const std::vector<Overview>& overviews)
      : parameters_(header.parameters),
        layout_(parameters_.bricks().count()),
        row_(parameters_.bricks().bricks(0)),
        code_(std::move(code)),
        header_(serialize_header(header)) {
    TagIndex index;
    std::vector<IndexEntry> entries(static_cast<std::size_t>(layout_.bricks_in(0)),
                                    {static_cast<std::uint32_t>(code_.activity.size()),
                                     static_cast<std::uint32_t>(code_.values.size()), 0, 9, 5});
    std::uint64_t checksum = 0;
    add_only_page(entries, checksum, index, [&](const std::vector<std::byte>& block) {
      page_.insert(page_.end(), block.begin(), block.end());
    });
    if (layout_.bricks_in(layout_.pages() - 1) != layout_.bricks_in(0) || layout_.bricks_in(0) % row_ != 0)
      throw std::logic_error("pages of this volume differ, or cut its rows");
    page_bytes_ = index.pages[0].bytes();
    page_checksum_ = checksum;
    index.pages.resize(static_cast<std::size_t>(layout_.pages()), index.pages[0]);
    index.activity_bytes = static_cast<std::uint64_t>(layout_.bricks()) * code_.activity.size();
    index.value_bytes = static_cast<std::uint64_t>(layout_.bricks()) * code_.values.size();
    end_at_ = header_.size() + static_cast<std::uint64_t>(layout_.pages()) * page_bytes_;
    for (const Overview& overview : overviews) {
      const Member member = {overview_kind, overview.factor, end_at_ + end_.size(), overview.bytes.size()};
      KeptBytes kept;
      MemberWriter writer(member, kept);
      writer.write(std::as_bytes(std::span(overview.bytes)));
      writer.finish(checksum);
      const auto bytes = std::as_bytes(std::span(kept.all));
      end_.insert(end_.end(), bytes.begin(), bytes.end());
      index.members.push_back(member);
    }
    const auto header_checksum = load_little_endian<std::uint64_t>(header_.data() + header_.size() - 8);
    const std::vector<std::byte> end =
        file_end(parameters_, index, end_at_ + end_.size(), checksum, header_checksum);
    end_.insert(end_.end(), end.begin(), end.end());
  }

  std::uint64_t size() const override { return end_at_ + end_.size(); }
  const std::string& name() const override { return name_; }
  std::uint64_t bytes_read() const {
    const std::lock_guard lock(mutex_);
    return bytes_read_;
  }

  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    const std::lock_guard lock(mutex_);
    bytes_read_ += to.size();
    for (std::uint64_t at = position; at < position + to.size();) {
      const auto [start, bytes] = part_at(at);
      const std::uint64_t count = std::min(start + bytes.size(), position + to.size()) - at;
      std::memcpy(to.data() + (at - position), bytes.data() + (at - start), count);
      at += count;
    }
  }

 private:
  struct Part {
    std::uint64_t start;
    std::span<const std::byte> bytes;
  };
  // The header, a brick, the blocks of a page, or the end: whichever has a byte.
  Part part_at(std::uint64_t at) const {
    if (at < header_.size()) return {0, header_};
    if (at >= end_at_) return {end_at_, end_};
    const std::uint64_t page = (at - header_.size()) / page_bytes_,
                        first = header_.size() + page * page_bytes_,
                        brick_bytes = block_frame_size + code_.activity.size() + code_.values.size(),
                        number = (at - first) / brick_bytes,
                        count = static_cast<std::uint64_t>(layout_.bricks_in(0));
    if (number >= count) return {first + count * brick_bytes, page_};
    return {first + number * brick_bytes, block(static_cast<std::int64_t>(page * count + number))};
  }
  // A brick's block, valid until the next call; that of the last brick of a row with the checksum 0.
  std::span<const std::byte> block(std::int64_t id) const {
    struct Kept : ByteSink {
      void write(std::span<const std::byte> bytes) override {
        all.insert(all.end(), bytes.begin(), bytes.end());
      }
      std::vector<std::byte> all;
    } sink;
    std::uint64_t before = 0;
    if (id == 0)
      before = load_little_endian<std::uint64_t>(header_.data() + header_.size() - 8);
    else if (id % layout_.bricks_in(0) == 0)
      before = page_checksum_;
    else if (id % row_ != 0)
      before = checksum(id - 1);
    write_block(sink, parameters_, {id, code_.activity, code_.values}, before);
    if (id % row_ == row_ - 1) std::fill(sink.all.end() - 8, sink.all.end(), std::byte{0});
    made_ = std::move(sink.all);
    return made_;
  }
  std::uint64_t checksum(std::int64_t id) const {
    const auto found = checksums_.find(id);
    if (found != checksums_.end()) return found->second;
    return checksums_[id] = load_little_endian<std::uint64_t>(block(id).last(8).data());
  }

  CodingParameters parameters_;
  PageLayout layout_;
  std::int64_t row_;
  BrickBytes code_;
  std::vector<std::byte> header_, page_, end_;
  std::uint64_t page_bytes_ = 0, page_checksum_ = 0, end_at_ = 0;
  std::string name_ = "repeated";
  mutable std::mutex mutex_;
  mutable std::map<std::int64_t, std::uint64_t> checksums_;
  mutable std::vector<std::byte> made_;
  mutable std::uint64_t bytes_read_ = 0;
};

}  // namespace tagrid
