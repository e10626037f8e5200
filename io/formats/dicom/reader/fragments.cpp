#include "io/formats/dicom/reader/fragments.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/dicom/reader/pixel_element.h"

namespace tagrid {
namespace {

constexpr std::uint32_t item_tag = 0xE000FFFE, end_tag = 0xE0DDFFFE;
/// Files with more fragments are refused.
constexpr std::size_t most_items = 1 << 20;

bool is_end(const ByteSource& file, std::uint64_t at) {
  std::array<std::byte, 4> tag;
  if (at > file.size() || file.size() - at < tag.size()) return false;
  file.read_at(at, tag);
  return load_little_endian<std::uint32_t>(tag.data()) == end_tag;
}

/// The first items of frames, of which the table of offsets has one each; nothing if it has not, or if there are
/// no fragments at these offsets.
std::vector<std::size_t> first_by_table(const ByteSource& file, const FragmentItem& table,
                                        const std::vector<FragmentItem>& items, std::size_t frames) {
  if (table.length != 4 * std::uint64_t{frames}) return {};
  std::vector<std::byte> numbers(memory_size(table.length));
  file.read_at(table.begin, numbers);
  std::vector<std::size_t> first;
  std::size_t item = 0;
  for (std::size_t i = 0; i < frames; ++i) {
    // Offsets are those of heads of items, from the first one on.
    const std::uint64_t begin =
        table.end() + item_head + load_little_endian<std::uint32_t>(numbers.data() + 4 * i);
    while (item < items.size() && items[item].begin < begin) ++item;
    if (item == items.size() || items[item].begin != begin || (i > 0 && item == first.back())) return {};
    first.push_back(item);
  }
  return first.front() == 0 ? first : std::vector<std::size_t>{};
}

std::vector<std::size_t> first_items(const ByteSource& file, const FragmentItem& table,
                                     const std::vector<FragmentItem>& items, const DicomFile& of) {
  const std::size_t frames = of.frames.size();
  if (frames == 1 && !items.empty()) return {0};
  std::vector<std::size_t> first;
  if (items.size() == frames) {
    for (std::size_t i = 0; i < frames; ++i) first.push_back(i);
    return first;
  }
  first = first_by_table(file, table, items, frames);
  if (!first.empty()) return first;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (begins_stream(file, items[i], of.pixels)) first.push_back(i);
  const bool is_one_each = first.size() == frames && first.front() == 0;
  return is_one_each ? first : std::vector<std::size_t>{};
}

}  // namespace

std::optional<FragmentItem> item_at(const ByteSource& file, std::uint64_t at) {
  std::array<std::byte, item_head> head;
  if (at > file.size() || file.size() - at < item_head) return std::nullopt;
  file.read_at(at, head);
  const auto length = load_little_endian<std::uint32_t>(head.data() + 4);
  const FragmentItem item{at + item_head, length};
  if (load_little_endian<std::uint32_t>(head.data()) != item_tag || length == unknown_length ||
      item.end() > file.size())
    return std::nullopt;
  return item;
}

std::vector<FragmentItem> fragments_from(const ByteSource& file, std::uint64_t begin) {
  const auto table = item_at(file, begin);
  if (!table) throw BrokenInput("its fragments cannot be found");
  std::vector<FragmentItem> items;
  std::uint64_t at = table->end();
  for (auto item = item_at(file, at); item; item = item_at(file, at)) {
    items.push_back(*item);
    if (items.size() > most_items) throw BrokenInput("its fragments are too many");
    at = item->end();
  }
  if (!is_end(file, at)) throw BrokenInput("ends too soon, within its pixels, or its fragments are damaged");
  return items;
}

bool begins_stream(const ByteSource& file, const FragmentItem& item, const DicomPixels& pixels) {
  std::array<char, 12> bytes = {};
  const std::size_t count = std::min<std::uint64_t>(bytes.size(), item.length);
  file.read_at(item.begin, std::as_writable_bytes(std::span(bytes)).first(count));
  const std::string_view beginning(bytes.data(), count);
  if (pixels.is_jpeg_xl())
    return beginning.starts_with("\xff\x0a") ||
           beginning == std::string_view("\0\0\0\x0cJXL \x0d\x0a\x87\x0a", 12);
  return beginning.starts_with("\xff\xd8\xff") || beginning.starts_with("\xff\x4f\xff");
}

CodeStreams::CodeStreams(const DicomFile& file)
    : bytes_(file.path),
      items_(fragments_from(bytes_, *file.pixels.encapsulated)),
      frames_(file.frames.size()) {
  first_ = first_items(bytes_, *item_at(bytes_, *file.pixels.encapsulated), items_, file);
}

std::vector<std::byte> CodeStreams::stream_of(std::size_t frame) const {
  if (first_.empty()) throw BrokenInput("frame {} cannot be found", frame + 1);
  const std::size_t end = frame + 1 < frames_ ? first_[frame + 1] : items_.size();
  std::vector<std::byte> stream;
  for (std::size_t i = first_[frame]; i < end; ++i) {
    const FragmentItem& item = items_[i];
    const std::size_t before = stream.size();
    stream.resize(before + memory_size(item.length));
    bytes_.read_at(item.begin, std::span(stream).subspan(before));
  }
  return stream;
}

}  // namespace tagrid
