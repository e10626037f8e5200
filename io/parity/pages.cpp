#include "io/parity/pages.h"

#include <algorithm>
#include <array>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/parity/reed_solomon.h"

namespace tagrid {
namespace {

constexpr std::size_t before_payload = parity_head_size - 8;

/// The payloads of a group of pages, in rows: pages of the table, then those of their parity.
class PageGroup {
 public:
  PageGroup(const ParityLayout& layout, std::uint64_t group)
      : layout_(layout), group_(group), code_(layout.pages_of_group(), layout.parity_of_group()) {
    const auto rows = static_cast<std::size_t>(table_rows() + layout.parity_of_group());
    bytes_.resize(rows * layout.payload());
    for (std::size_t row = 0; row < rows; ++row) starts_.push_back(bytes_.data() + row * layout.payload());
  }

  int table_rows() const { return layout_.pages_of_group(); }
  int rows() const { return static_cast<int>(starts_.size()); }
  std::span<std::byte> payload(int row) {
    return {starts_[static_cast<std::size_t>(row)], layout_.payload()};
  }
  /// Number of the page in a row; nothing for a row of zeros that fills the group up.
  std::optional<std::uint64_t> number(int row) const {
    const bool of_table = row < table_rows();
    const std::uint64_t page =
        static_cast<std::uint64_t>(of_table ? row : row - table_rows()) * layout_.groups() + group_;
    if (!of_table) return layout_.pages() + page;
    return page < layout_.pages() ? std::optional(page) : std::nullopt;
  }
  void encode() { code_.encode(starts_, layout_.payload()); }
  void restore(std::span<const int> lost) { code_.restore(starts_, lost, layout_.payload()); }

 private:
  const ParityLayout& layout_;
  std::uint64_t group_;
  ReedSolomon code_;
  std::vector<std::byte> bytes_;
  std::vector<std::byte*> starts_;
};

/// Calls use(byte of the payload, number of the checksum) for the checksums of a page. A payload is a
/// multiple of 8 bytes.
template <class Use>
void for_each_checksum(const ParityLayout& layout, std::uint64_t page, std::uint64_t count, Use use) {
  const std::uint64_t in_page = layout.payload() / 8, begin = page * in_page;
  for (std::uint64_t i = begin; i < std::min(count, begin + in_page); ++i) use(8 * (i - begin), i);
}

}  // namespace

std::uint64_t id_of_table(std::span<const std::uint64_t> checksums) {
  RunningChecksum sum;
  for (const std::uint64_t checksum : checksums) {
    std::array<std::byte, 8> bytes;
    store_little_endian(bytes.data(), checksum);
    sum.add(bytes);
  }
  return sum.value();
}

void make_pages(const ParityLayout& layout, std::span<const std::uint64_t> checksums,
                const std::function<void(std::uint64_t, std::span<const std::byte>)>& use) {
  for (std::uint64_t g = 0; g < layout.groups(); ++g) {
    PageGroup group(layout, g);
    for (int row = 0; row < group.table_rows(); ++row)
      if (const auto page = group.number(row))
        for_each_checksum(layout, *page, checksums.size(), [&](std::uint64_t at, std::uint64_t i) {
          store_little_endian(group.payload(row).data() + at, checksums[i]);
        });
    group.encode();
    for (int row = 0; row < group.rows(); ++row)
      if (const auto page = group.number(row))
        use(*page, serialize_description(layout, static_cast<std::uint32_t>(*page), group.payload(row)));
  }
}

std::optional<std::vector<std::uint64_t>> read_pages(
    const ParityLayout& layout, const std::function<void(std::uint64_t, std::span<std::byte>)>& read,
    std::uint64_t& damaged) {
  damaged = 0;
  std::vector<std::uint64_t> checksums(memory_size(layout.sequence()));
  std::vector<std::byte> page(layout.block_size());
  bool all_known = true;
  for (std::uint64_t g = 0; g < layout.groups(); ++g) {
    PageGroup group(layout, g);
    std::vector<int> lost;
    for (int row = 0; row < group.rows(); ++row) {
      const auto number = group.number(row);
      if (!number) continue;
      read(*number, page);
      const auto found = parse_description(page);
      if (found && found->layout == layout && found->number == *number)
        std::ranges::copy(std::span(page).subspan(before_payload, layout.payload()),
                          group.payload(row).begin());
      else
        lost.push_back(row);
    }
    damaged += lost.size();
    if (static_cast<int>(lost.size()) > layout.parity_of_group()) {
      all_known = false;
      continue;
    }
    group.restore(lost);
    for (int row = 0; row < group.table_rows(); ++row)
      if (const auto number = group.number(row))
        for_each_checksum(layout, *number, checksums.size(), [&](std::uint64_t at, std::uint64_t i) {
          checksums[i] = load_little_endian<std::uint64_t>(group.payload(row).data() + at);
        });
  }
  if (!all_known || id_of_table(checksums) != layout.id) return std::nullopt;
  return checksums;
}

}  // namespace tagrid
