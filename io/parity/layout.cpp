#include "io/parity/layout.h"

#include <array>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr int least_log2_block = 9, largest_log2_block = 18;
/// Beyond this, numbers of stripes and pages would not fit their fields.
constexpr std::uint64_t largest_file = std::uint64_t{1} << 54;

int parity_for(int data, ParityShare share) {
  return static_cast<int>((std::uint64_t{share} * static_cast<std::uint64_t>(data) + whole_share - 1) /
                          whole_share);
}

/// Blocks of 4 KiB, as sectors and pages have; smaller ones in files with few of them, larger ones where more
/// than a million would need a large table.
std::uint8_t log2_block_for(std::uint64_t file_size) {
  std::uint8_t log2 = least_log2_block;
  while (log2 < largest_log2_block && file_size >> log2 >= (log2 < 12 ? 1U << 9 : 1U << 20)) ++log2;
  return log2;
}

}  // namespace

std::string text_of_share(ParityShare share) {
  std::string text = std::to_string(share / 1000), fraction = std::to_string(1000 + share % 1000).substr(1);
  while (!fraction.empty() && fraction.back() == '0') fraction.pop_back();
  return text + (fraction.empty() ? "" : "." + fraction) + " %";
}

ParityLayout ParityLayout::of(std::uint64_t file_size, ParityShare share) {
  if (file_size > largest_file)
    throw UsageError("a file of more than 2^54 bytes cannot be protected by parity");
  ParityLayout layout;
  layout.file_size = file_size;
  layout.share = share;
  layout.log2_block = log2_block_for(file_size);
  int largest = 1;
  while (largest + 1 + parity_for(largest + 1, share) <= largest_stripe) ++largest;
  const auto most = static_cast<std::uint64_t>(largest);
  layout.stripes = static_cast<std::uint32_t>((layout.blocks() + most - 1) / most);
  layout.parity = static_cast<std::uint8_t>(parity_for(layout.data(), share));
  return layout;
}

bool ParityLayout::is_valid() const {
  if (file_size == 0 || file_size > largest_file) return false;
  if (log2_block < least_log2_block || log2_block > largest_log2_block) return false;
  if (stripes == 0 || stripes > blocks() || parity == 0 || parity > 127) return false;
  if (share < least_share || share > whole_share) return false;
  const std::uint64_t data = (blocks() + stripes - 1) / stripes;
  return data + parity <= largest_stripe && all_pages() < head_number;
}

std::uint64_t ParityDescription::place(std::uint64_t base) const {
  if (number == head_number) return base;
  return number == foot_number ? layout.foot(base) : layout.place_of_page(base, number);
}

std::vector<std::byte> serialize_description(const ParityLayout& layout, std::uint32_t number,
                                             std::span<const std::byte> payload) {
  FieldWriter fields;
  fields.put_bytes(std::as_bytes(std::span(parity_magic)));
  fields.put(layout.file_size);
  fields.put(layout.id);
  fields.put(layout.stripes);
  fields.put(number);
  fields.put(layout.share);
  fields.put(layout.log2_block);
  fields.put(layout.parity);
  fields.put(std::uint16_t{0});
  fields.put_bytes(payload);
  fields.put(checksum_of({fields.bytes()}));
  return std::move(fields.bytes());
}

std::optional<ParityDescription> claimed_description(std::span<const std::byte> bytes) {
  if (bytes.size() < parity_head_size ||
      !std::ranges::equal(bytes.first(parity_magic.size()), std::as_bytes(std::span(parity_magic))))
    return std::nullopt;
  FieldReader fields(bytes.subspan(parity_magic.size()));
  ParityDescription claimed;
  fields.field(claimed.layout.file_size);
  fields.field(claimed.layout.id);
  fields.field(claimed.layout.stripes);
  fields.field(claimed.number);
  fields.field(claimed.layout.share);
  fields.field(claimed.layout.log2_block);
  fields.field(claimed.layout.parity);
  if (fields.get<std::uint16_t>() != 0 || !claimed.layout.is_valid()) return std::nullopt;
  const std::uint32_t number = claimed.number;
  const bool is_known = number < claimed.layout.all_pages() || number == head_number || number == foot_number;
  return is_known ? std::optional(claimed) : std::nullopt;
}

std::optional<ParityDescription> parse_description(std::span<const std::byte> bytes) {
  const auto claimed = claimed_description(bytes);
  if (!claimed) return std::nullopt;
  const std::uint64_t size = claimed->size();
  if (bytes.size() < size) return std::nullopt;
  const auto stored = load_little_endian<std::uint64_t>(bytes.data() + size - 8);
  return checksums_agree(stored, checksum_of({bytes.first(size - 8)})) ? claimed : std::nullopt;
}

std::optional<ParityLayout> parity_at_end(std::uint64_t size, std::span<const std::byte> last) {
  if (last.size() < parity_head_size) return std::nullopt;
  const auto foot = parse_description(last.last(parity_head_size));
  if (!foot || foot->number != foot_number || foot->layout.end(foot->layout.file_size) != size)
    return std::nullopt;
  return foot->layout;
}

std::optional<ParityLayout> parity_at_end(const ByteSource& file) {
  const std::uint64_t size = file.size();
  if (size < parity_head_size) return std::nullopt;
  std::array<std::byte, parity_head_size> last;
  file.read_at(size - last.size(), last);
  return parity_at_end(size, last);
}

std::shared_ptr<const ByteSource> beginning_of(std::shared_ptr<const ByteSource> source, std::uint64_t size) {
  std::string name = source->name();
  return std::make_shared<PartOfSource>(std::move(source), 0, size, std::move(name));
}

std::optional<ParityLayout> parity_that_follows(std::span<const std::byte> head, std::uint64_t position) {
  const auto found = parse_description(head);
  if (!found || found->number != head_number || found->layout.file_size != position) return std::nullopt;
  return found->layout;
}

}  // namespace tagrid
