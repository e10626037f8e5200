#include "tools/formats/jp2/outline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

namespace tagrid {
namespace {

/// The number of `size` bytes at `at`, the highest one first; nothing beyond `end`.
std::optional<std::uint64_t> number(const ByteSource& file, std::uint64_t at, std::size_t size,
                                    std::uint64_t end) {
  std::array<std::byte, 8> bytes = {};
  if (at > end || end - at < size) return std::nullopt;
  file.read_at(at, std::span(bytes).first(size));
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value = value << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  return value;
}

constexpr std::uint64_t start_of_tile = 0xff90, end_of_stream = 0xffd9, start_of_stream = 0xff4f;

/// The byte after a code stream, whose tiles say how long they are; `end` if one does not, or is damaged.
std::uint64_t end_of_code_stream(const ByteSource& file, std::uint64_t at, std::uint64_t end) {
  at += 2;  // the start of the stream has no length
  while (const auto marker = number(file, at, 2, end)) {
    if (*marker == end_of_stream) return at + 2;
    const bool is_tile = *marker == start_of_tile;
    const auto length = is_tile ? number(file, at + 6, 4, end) : number(file, at + 2, 2, end);
    // A tile counts its marker, and is the last one if its length is 0. Others count their length.
    if (!length || *length < 2 || *length > end - at) return end;
    at += *length + (is_tile ? 0 : 2);
  }
  return end;
}

class Walk {
 public:
  explicit Walk(const ByteSource& file) : file_(file) {
    const std::uint64_t size = file.size();
    if (number(file, 0, 2, size) == start_of_stream) {
      add_code_stream(0, size);
      return;
    }
    const std::uint64_t end = boxes(0, size, 0);
    outline.after += size - end;
  }

  Jp2Outline outline;

 private:
  static constexpr std::uint64_t box(std::string_view name) {
    std::uint64_t value = 0;
    for (const char c : name) value = value << 8 | static_cast<unsigned char>(c);
    return value;
  }

  /// Returns where the last box ends. A length of 0 is that of all that is left, and 1 says that a longer
  /// number follows.
  std::uint64_t boxes(std::uint64_t at, std::uint64_t end, int depth) {
    while (at < end) {
      auto length = number(file_, at, 4, end);
      const auto name = number(file_, at + 4, 4, end);
      std::uint64_t head = 8;
      if (length == 1) {
        length = number(file_, at + 8, 8, end);
        head = 16;
      }
      if (length == 0) length = end - at;
      if (!length || !name || *length < head || *length > end - at) return at;
      if (*name == box("jp2c")) add_code_stream(at + head, at + *length);
      if (*name == box("pclr")) outline.has_palette = true;
      if (*name == box("jp2h") && depth == 0) boxes(at + head, at + *length, 1);
      at += *length;
    }
    return end;
  }

  void add_code_stream(std::uint64_t at, std::uint64_t end) {
    ++outline.images;
    constexpr std::uint64_t extensions = 0x8000;
    if (const auto needs = number(file_, at + 6, 2, end); needs && (*needs & extensions) != 0)
      outline.has_extensions = true;
    outline.after += end - std::min(end, end_of_code_stream(file_, at, end));
  }

  const ByteSource& file_;
};

}  // namespace

Jp2Outline jp2_outline(const ByteSource& file) { return Walk(file).outline; }

}  // namespace tagrid
