// Files with an index of any content: with other entries than those of their bricks, or of volumes that are too large
// to be made.
#pragma once

#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/file_bytes.h"
#include "io/files/output_file.h"
#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/pages.h"

namespace tagrid {

/// The blocks of the only page of a file, after its bricks, and the directory's facts of it.
inline void add_only_page(const std::vector<IndexEntry>& entries, std::uint64_t& checksum, TagIndex& index,
                          const std::function<void(const std::vector<std::byte>&)>& write) {
  PageFacts facts;
  index.activity_bytes = index.value_bytes = 0;
  for (const IndexEntry& entry : entries) {
    index.activity_bytes += entry.activity_bytes;
    index.value_bytes += entry.value_bytes;
    facts.brick_bytes += block_frame_size + entry.activity_bytes + entry.value_bytes;
  }
  take_range(entries, facts);
  const std::vector<std::byte> sizes = packed_block(sizes_marker, serialize_sizes(entries), checksum),
                               statistics =
                                   packed_block(statistics_marker, serialize_statistics(entries), checksum);
  facts.sizes_bytes = static_cast<std::uint32_t>(sizes.size());
  facts.statistics_bytes = static_cast<std::uint32_t>(statistics.size());
  write(sizes);
  write(statistics);
  index.pages = {facts};
}

/// A file of a volume that is too large to be made, with right pages and directory. Its bricks are zeros, except for
/// one. No byte of it is stored but those of the parts that differ.
class ForgedTag : public ByteSource {
 public:
  /// `values` are those of every brick, which has no activity. `whole_brick` is there, and has these values.
  ForgedTag(const TagHeader& header, const std::vector<std::uint8_t>& values, std::int64_t whole_brick)
      : layout_(header.parameters.bricks().count()), header_(serialize_header(header)) {
    const std::uint64_t brick_bytes = block_frame_size + values.size();
    TagIndex index;
    const auto add_page = [&](std::int64_t page) {
      std::vector<IndexEntry> entries(static_cast<std::size_t>(layout_.bricks_in(page)),
                                      {0, static_cast<std::uint32_t>(values.size()), -1, 7, 2});
      std::uint64_t checksum = 0;  // of the bricks, which are zeros
      std::vector<std::byte> blocks;
      TagIndex one;
      add_only_page(entries, checksum, one, [&](const std::vector<std::byte>& block) {
        blocks.insert(blocks.end(), block.begin(), block.end());
      });
      last_checksum_ = checksum;
      blocks_.push_back(blocks);
      facts_.push_back(one.pages[0]);
    };
    add_page(0);
    add_page(layout_.pages() - 1);
    for (std::int64_t page = 0; page < layout_.pages(); ++page) index.pages.push_back(facts_of(page));
    index.value_bytes = static_cast<std::uint64_t>(layout_.bricks()) * values.size();
    std::uint64_t end = header_.size();
    for (const PageFacts& page : index.pages) end += page.bytes();
    end_at_ = end;
    const auto header_checksum = load_little_endian<std::uint64_t>(header_.data() + header_.size() - 8);
    end_ = file_end(header.parameters, index, end, last_checksum_, header_checksum);
    whole_at_ =
        header_.size() + static_cast<std::uint64_t>(layout_.page_of(whole_brick)) * facts_[0].bytes() +
        static_cast<std::uint64_t>(whole_brick - layout_.first(layout_.page_of(whole_brick))) * brick_bytes;
    struct Kept : ByteSink {
      void write(std::span<const std::byte> bytes) override {
        all.insert(all.end(), bytes.begin(), bytes.end());
      }
      std::vector<std::byte> all;
    } sink;
    write_block(sink, header.parameters, {whole_brick, {}, values}, 0);
    whole_ = sink.all;
  }

  /// Changes a byte of the file.
  void damage(std::uint64_t at) { damaged_ = at; }
  std::uint64_t end_of_bricks(std::int64_t page) const {
    return header_.size() + static_cast<std::uint64_t>(page) * facts_[0].bytes() + facts_of(page).brick_bytes;
  }
  const PageFacts& facts_of(std::int64_t page) const { return facts_[page + 1 == layout_.pages()]; }
  std::uint64_t start_of_whole_brick() const { return whole_at_; }
  std::uint64_t bytes_of_whole_brick() const { return whole_.size(); }

  std::uint64_t size() const override { return end_at_ + end_.size(); }
  const std::string& name() const override { return name_; }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    const std::lock_guard lock(mutex_);
    reads_.emplace_back(position, position + to.size());
    std::fill(to.begin(), to.end(), std::byte{0});
    const auto put = [&](std::uint64_t at, const std::vector<std::byte>& bytes) {
      const std::uint64_t first = std::max(at, position),
                          last = std::min(at + bytes.size(), position + to.size());
      if (first < last)
        std::memcpy(to.data() + (first - position), bytes.data() + (first - at), last - first);
    };
    put(0, header_);
    put(end_at_, end_);
    const std::uint64_t step = facts_[0].bytes(), begin = header_.size();
    const std::uint64_t page_at = position < begin + step ? 0 : (position - begin) / step - 1;
    for (auto page = static_cast<std::int64_t>(page_at); page < layout_.pages(); ++page) {
      if (begin + static_cast<std::uint64_t>(page) * step > position + to.size()) break;
      put(end_of_bricks(page), blocks_[page + 1 == layout_.pages()]);
    }
    put(whole_at_, whole_);
    if (damaged_ >= position && damaged_ < position + to.size()) to[damaged_ - position] ^= std::byte{8};
  }
  std::vector<std::pair<std::uint64_t, std::uint64_t>> reads() const {
    const std::lock_guard lock(mutex_);
    return std::exchange(reads_, {});
  }

 private:
  PageLayout layout_;
  std::vector<std::byte> header_, end_, whole_;
  std::vector<std::vector<std::byte>> blocks_;  ///< of the first page, and of the last one
  std::vector<PageFacts> facts_;
  std::uint64_t end_at_ = 0, whole_at_ = 0, last_checksum_ = 0, damaged_ = ~std::uint64_t{0};
  std::string name_ = "forged";
  mutable std::mutex mutex_;
  mutable std::vector<std::pair<std::uint64_t, std::uint64_t>> reads_;
};

}  // namespace tagrid
