#include "io/formats/zarr/reader/pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/formats/zarr/crc32c.h"
#include "io/formats/zarr/reader/n5.h"
#include "io/programs/serve.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::size_t place_bytes = 16, crc_of_index = 4;
/// Places in the indices that are kept: some megabytes, unless one shard has more.
constexpr std::size_t most_places = std::size_t{1} << 18;

std::uint64_t number_at(const std::byte* at, bool big_endian) {
  const auto number = load_little_endian<std::uint64_t>(at);
  return big_endian ? byte_swapped(number) : number;
}

/// What is not compressed well may be somewhat longer.
std::uint64_t most_stored(std::uint64_t bytes) { return 2 * bytes + (std::uint64_t{1} << 16); }

}  // namespace

std::uint64_t ZarrPieces::memory() const {
  return 2 * most_stored(array_.piece_bytes()) + 4 * most_places * place_bytes;
}

ZarrPieces::InChunk ZarrPieces::in_chunk(const std::vector<std::int64_t>& numbers) const {
  InChunk place = {.chunk = numbers};
  for (std::size_t axis = 0; axis < numbers.size(); ++axis) {
    const std::int64_t ratio = array_.chunk[axis] / array_.piece[axis];
    place.chunk[axis] = numbers[axis] / ratio;
    place.number =
        place.number * static_cast<std::uint64_t>(ratio) + static_cast<std::uint64_t>(numbers[axis] % ratio);
    if (__builtin_mul_overflow(place.count, static_cast<std::uint64_t>(ratio), &place.count))
      place.count = never_written;
  }
  return place;
}

std::uint64_t ZarrPieces::count(const std::vector<std::int64_t>& chunk, const PieceBox& box) {
  if (!array_.shards) return 1;
  const std::string key = array_.key(chunk);
  const auto file = store_.find(key);
  if (!file) return 0;
  std::vector<std::int64_t> first = chunk;
  for (std::size_t axis = 0; axis < chunk.size(); ++axis)
    first[axis] *= array_.chunk[axis] / array_.piece[axis];
  const Index& index = index_of(key, *file->bytes, in_chunk(first).count);
  std::uint64_t written = 0;
  for (std::size_t number = 0; number < index.size(); ++number) {
    if (!index[number].is_written()) continue;
    bool is_inside = true;
    std::size_t rest = number;
    for (std::size_t axis = chunk.size(); axis-- > 0;) {
      const auto ratio = static_cast<std::size_t>(array_.chunk[axis] / array_.piece[axis]);
      const std::int64_t at = first[axis] + static_cast<std::int64_t>(rest % ratio);
      is_inside &= at >= box.first[axis] && at < box.end[axis];
      rest /= ratio;
    }
    written += is_inside ? 1 : 0;
  }
  return written;
}

std::optional<std::vector<std::byte>> ZarrPieces::read(const std::vector<std::int64_t>& numbers) {
  const InChunk place = in_chunk(numbers);
  const std::string key = array_.key(place.chunk);
  const auto file = store_.find(key);
  if (!file) return std::nullopt;
  const std::string& name = file->bytes->name();
  const std::uint64_t size = array_.piece_bytes();
  if (array_.is_n5)
    return n5_block(file->all(most_stored(size) + most_n5_header(numbers.size())), array_, numbers, name);
  if (!array_.shards) return decompressed(file->all(most_stored(size)), array_.codecs, size, name);
  const Place found = index_of(key, *file->bytes, place.count)[place.number];
  if (!found.is_written()) return std::nullopt;
  return decompressed(read_at(*file->bytes, found, name), array_.codecs, size,
                      fmt::format("{}: chunk {}", name, place.number));
}

const ZarrPieces::Index& ZarrPieces::index_of(const std::string& key, const ByteSource& shard,
                                              std::uint64_t pieces) {
  if (const auto known = indices_.find(key); known != indices_.end()) return known->second;
  const std::size_t crc = array_.shards->index_has_crc ? crc_of_index : 0;
  if (shard.size() < crc || pieces > (shard.size() - crc) / place_bytes)
    throw BrokenInput("{}: is too short for the index of its {} chunks; it may be truncated", shard.name(),
                      pieces);
  std::vector<std::byte> bytes(memory_size(pieces * place_bytes + crc));
  shard.read_at(array_.shards->index_is_last ? shard.size() - bytes.size() : 0, bytes);
  const std::span<const std::byte> content = std::span(bytes).first(bytes.size() - crc);
  if (crc > 0 && load_little_endian<std::uint32_t>(&bytes[content.size()]) != crc32c(content))
    throw BrokenInput(shard.name() + ": is damaged: the checksum of its index is another one");
  if (places_ + pieces > most_places) {
    indices_.clear();
    places_ = 0;
  }
  Index& index = indices_[key];
  index.resize(memory_size(pieces));
  places_ += index.size();
  for (std::size_t i = 0; i < index.size(); ++i)
    index[i] = {number_at(&bytes[i * place_bytes], array_.shards->index_is_big_endian),
                number_at(&bytes[i * place_bytes + 8], array_.shards->index_is_big_endian)};
  return index;
}

std::vector<std::byte> ZarrPieces::read_at(const ByteSource& shard, const Place& place,
                                           const std::string& name) const {
  if (place.size > shard.size() || place.position > shard.size() - place.size)
    throw BrokenInput(name + ": its index leads beyond its end; it may be truncated");
  if (place.size > most_stored(array_.piece_bytes()))
    throw BrokenInput("{}: a chunk of {} bytes is stored as {}", name, array_.piece_bytes(), place.size);
  std::vector<std::byte> bytes(memory_size(place.size));
  shard.read_at(place.position, bytes);
  return bytes;
}

namespace {

/// "0", "12", but not "012".
std::optional<std::int64_t> number_of_chunk(std::string_view text) {
  std::int64_t number = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_plain = !text.empty() && text[0] != '-' && (text[0] != '0' || text.size() == 1);
  if (!is_plain || result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

/// How keys of chunks are made.
struct Rule {
  bool has_c = false;
  char separator = '/';
  bool operator==(const Rule&) const = default;
};

class Walk {
 public:
  Walk(const ZarrStore& store, const ZarrArray& array, ZarrPieces& pieces, const PieceBox& volume)
      : store_(store), array_(array), pieces_(pieces), volume_(volume) {
    for (std::size_t axis = 0; axis < array.shape.size(); ++axis) {
      const std::int64_t ratio = array.chunk[axis] / array.piece[axis];
      chunks_.first.push_back(volume.first[axis] / ratio);
      chunks_.end.push_back((volume.end[axis] - 1) / ratio + 1);
    }
  }

  ZarrPresence run() {
    store_.list(array_.path, [&](const std::string& name, bool is_folder) {
      say_working();
      if (!is_folder)
        look_at_file(name);
      else if (name == "c")
        folders_.push_back({{true, '/'}, joined(array_.path, name), {}});
      else
        add_folder({{false, '/'}, array_.path, {}}, name);
    });
    while (!folders_.empty()) {
      const Folder folder = std::move(folders_.back());
      folders_.pop_back();
      look_into(folder);
    }
    return found_;
  }

 private:
  /// A folder of chunks, whose first numbers are those of its path.
  struct Folder {
    Rule rule;
    std::string path;
    std::vector<std::int64_t> numbers;
  };

  Rule expected() const {
    // Without a separator, both rules are one.
    const bool has_separator = array_.shape.size() > 1 || !array_.first_of_keys.empty();
    return {!array_.first_of_keys.empty(), has_separator ? array_.separator : '.'};
  }

  /// "0.1.2" or "c.0.1.2".
  void look_at_file(const std::string& name) {
    std::vector<std::string_view> parts = split(name, '.');
    const bool has_c = parts.size() > 1 && parts[0] == "c";
    if (has_c) parts.erase(parts.begin());
    std::vector<std::int64_t> numbers;
    for (const std::string_view part : parts) {
      const auto number = number_of_chunk(part);
      if (!number || !is_of_volume(numbers.size(), *number)) return;
      numbers.push_back(*number);
    }
    if (numbers.size() == array_.shape.size()) add({has_c, '.'}, numbers, joined(array_.path, name));
  }

  void add_folder(Folder folder, const std::string& name) {
    const auto number = number_of_chunk(name);
    if (!number || folder.numbers.size() + 1 >= array_.shape.size() ||
        !is_of_volume(folder.numbers.size(), *number))
      return;
    folder.path = joined(folder.path, name);
    folder.numbers.push_back(*number);
    folders_.push_back(std::move(folder));
  }

  void look_into(const Folder& folder) {
    store_.list(folder.path, [&](const std::string& name, bool is_folder) {
      say_working();
      if (is_folder) return add_folder(folder, name);
      const auto number = number_of_chunk(name);
      if (!number || folder.numbers.size() + 1 != array_.shape.size() ||
          !is_of_volume(folder.numbers.size(), *number))
        return;
      std::vector<std::int64_t> numbers = folder.numbers;
      numbers.push_back(*number);
      add(folder.rule, numbers, joined(folder.path, name));
    });
  }

  /// True for a number that is the one at `place` in a key.
  bool is_of_volume(std::size_t place, std::int64_t number) const {
    const std::size_t axis = array_.is_n5 ? chunks_.first.size() - 1 - place : place;
    return axis < chunks_.first.size() && number >= chunks_.first[axis] && number < chunks_.end[axis];
  }

  void add(Rule rule, std::vector<std::int64_t> numbers, const std::string& key) {
    if (array_.is_n5) std::ranges::reverse(numbers);
    if (rule == expected()) {
      found_.written += pieces_.count(numbers, volume_);
    } else if (found_.other_key.empty() || key < found_.other_key) {  // whatever the order of the folder
      found_.other_key = key;
      found_.expected_key = array_.key(numbers);
    }
  }

  const ZarrStore& store_;
  const ZarrArray& array_;
  ZarrPieces& pieces_;
  const PieceBox& volume_;
  PieceBox chunks_;  ///< of the volume
  std::vector<Folder> folders_;
  ZarrPresence found_;
};

}  // namespace

ZarrPresence presence_of(const ZarrStore& store, const ZarrArray& array, ZarrPieces& pieces,
                         const PieceBox& volume) {
  return Walk(store, array, pieces, volume).run();
}

}  // namespace tagrid
