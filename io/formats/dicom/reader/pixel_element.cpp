#include "io/formats/dicom/reader/pixel_element.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/codecs/jpeg2000.h"
#include "io/formats/dicom/reader/fragments.h"
#include "io/formats/dicom/reader/jpeg_xl.h"
#include "io/programs/stored_samples.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

void note_more_frames(DicomFile& file, std::uint64_t found) {
  const std::uint64_t frames = file.frames.size();
  file.notes.miss(
      "NumberOfFrames",
      fmt::format(
          "its pixels are those of {}, but it says that it has {} (NumberOfFrames); the others are left out",
          counted(found, "frame"), frames));
}

/// True for zeros that fill up a word of four bytes, as some programs do. The standard asks for an even
/// length.
bool is_padding(const ByteSource& file, std::uint64_t begin, std::uint64_t length) {
  std::array<std::byte, 3> bytes = {};
  if (length > bytes.size() || begin + length > file.size()) return false;
  file.read_at(begin, std::span(bytes).first(length));
  return std::ranges::all_of(bytes, [](std::byte byte) { return byte == std::byte{0}; });
}

/// Of a stream; its header is at its beginning.
constexpr std::uint64_t most_bytes = 1 << 16;

/// The length of an item, which its tag and four bytes say.
std::uint64_t length_at(const ByteSource& file, std::uint64_t item) {
  std::byte bytes[4];
  if (item + 8 > file.size()) throw BrokenInput("ends too soon");
  file.read_at(item + 4, bytes);
  return load_little_endian<std::uint32_t>(bytes);
}

std::vector<std::byte> beginning_of_stream(const ByteSource& file, std::uint64_t fragments) {
  const std::uint64_t begin = first_stream(file, fragments);
  const std::uint64_t length = length_at(file, begin - 8);
  std::vector<std::byte> bytes(std::min({length, most_bytes, file.size() - begin}));
  file.read_at(begin, bytes);
  return bytes;
}

/// The error of samples that a JPEG-LS stream allows (NEAR in its scan); nothing if there is no such scan.
std::optional<int> error_of_jpeg_ls(std::span<const std::byte> bytes) {
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(bytes[i]); };
  constexpr unsigned start_of_scan = 0xDA;
  for (std::size_t i = 2; i + 5 <= bytes.size() && at(i) == 0xFF;) {
    if (at(i + 1) == start_of_scan) {
      const std::size_t position = i + 5 + std::size_t{2} * at(i + 4);
      return position < bytes.size() ? std::optional<int>(at(position)) : std::nullopt;
    }
    i += 2 + (std::size_t{at(i + 2)} << 8 | at(i + 3));
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::uint64_t> pixel_length(const ByteSource& file, std::uint64_t offset, bool is_explicit,
                                          bool big_endian) {
  std::array<std::byte, 12> head = {};
  const std::uint64_t bytes = is_explicit ? 12 : 8;
  if (offset < bytes || offset > file.size()) throw BrokenInput("its pixels cannot be found");
  file.read_at(offset - bytes, std::span(head).first(bytes));
  const auto number = [&](std::size_t at, std::size_t count) {
    return number_in(std::span(head).subspan(at, count), big_endian);
  };
  const std::uint64_t length = number(bytes - 4, 4);
  if (number(0, 2) != 0x7fe0 || number(2, 2) != 0x0010) throw BrokenInput("its pixels cannot be found");
  return length == unknown_length ? std::nullopt : std::optional(length);
}

void check_native_pixels(DicomFile& file, const ByteSource& bytes, std::uint64_t length,
                         std::uint64_t offset) {
  const DicomPixels& pixels = file.pixels;
  const std::uint64_t frames = file.frames.size(), frame = pixels.frame_bytes(), wanted = frames * frame;
  if (length < wanted)
    throw BrokenInput("its pixels have {} bytes, but {} x {} samples of {} bits in {} have {}", length,
                      pixels.columns, pixels.rows, pixels.allocated, counted(frames, "frame"), wanted);
  if (bytes.size() < offset + wanted)
    throw BrokenInput("ends too soon, within its pixels: {} bytes are missing",
                      offset + wanted - bytes.size());
  if (!is_padding(bytes, offset + wanted, length - wanted)) note_bytes_left_over(file, length);
}

void note_bytes_left_over(DicomFile& file, std::uint64_t bytes) {
  const DicomPixels& pixels = file.pixels;
  const std::uint64_t frames = file.frames.size(), frame = pixels.frame_bytes(),
                      over = bytes - frames * frame;
  if (over <= 1) return;  // lengths are even
  if (over >= frame) return note_more_frames(file, bytes / frame);
  file.notes.miss("PixelData",
                  fmt::format("its pixels have {} bytes more than {} x {} samples of {} bits in {}; they "
                              "are left out",
                              over, pixels.columns, pixels.rows, pixels.allocated, counted(frames, "frame")));
}

void check_streams(DicomFile& file, const ByteSource& bytes, std::uint64_t begin) {
  const auto table = item_at(bytes, begin);
  if (!table) return;
  const std::uint64_t frames = file.frames.size();
  // In RLE, each fragment is a frame.
  const bool is_rle = file.pixels.syntax == "1.2.840.10008.1.2.5";
  std::uint64_t streams = 0;
  for (auto item = item_at(bytes, table->end()); item; item = item_at(bytes, item->end()))
    if (is_rle || begins_stream(bytes, *item, file.pixels)) ++streams;
  const std::uint64_t found = std::max(streams, table->length / 4);
  if (found > frames) note_more_frames(file, found);
}

void find_plain_fragments(DicomFile& file, const ByteSource& bytes, std::uint64_t begin) {
  DicomPixels& pixels = file.pixels;
  const std::uint64_t frames = file.frames.size(), frame = pixels.frame_bytes(), even = frame + frame % 2;
  const std::vector<FragmentItem> items = fragments_from(bytes, begin);
  std::uint64_t all = 0;
  for (const FragmentItem& item : items) all += item.length;
  const bool one_each = std::ranges::all_of(
      items, [&](const auto& item) { return item.length == frame || item.length == even; });
  if (one_each && items.size() >= frames) {
    pixels.offset = items.front().begin;
    pixels.step = even + item_head;
    // Items of odd length are forbidden, but exist.
    for (std::size_t i = 0; i < items.size() && frames > 1; ++i)
      if (items[i].begin != *pixels.offset + i * pixels.step)
        throw BrokenInput("its fragments have odd lengths");
    if (items.size() > frames) note_more_frames(file, items.size());
    return;
  }
  if (all < frames * frame || all > frames * frame + 1)
    throw BrokenInput("its fragments have {} bytes, but {} x {} samples of {} bits in {} have {}", all,
                      pixels.columns, pixels.rows, pixels.allocated, counted(frames, "frame"),
                      frames * frame);
  for (const FragmentItem& item : items) pixels.stretches.push_back({item.begin, item.length});
}

void read_from_stretches(const DicomFile& file, std::size_t frame, std::byte* out) {
  const std::uint64_t size = file.pixels.frame_bytes();
  std::uint64_t from = frame * size, left = size;
  const FileSource bytes(file.path);
  for (const auto& [offset, length] : file.pixels.stretches) {
    if (left == 0) return;
    if (from >= length) {
      from -= length;
      continue;
    }
    const std::uint64_t n = std::min(left, length - from);
    if (offset + from + n > bytes.size())
      throw BrokenInput("{}: DICOM file: ends too soon, within its pixels", file.path);
    bytes.read_at(offset + from, std::span(out, n));
    out += n;
    left -= n;
    from = 0;
  }
  if (left > 0) throw BrokenInput("{}: DICOM file: frame {} is not complete", file.path, frame + 1);
}

std::uint64_t first_stream(const ByteSource& file, std::uint64_t fragments) {
  return fragments + 8 + length_at(file, fragments) + 8;
}

std::optional<int> bits_of_jpeg_xl(const DicomFile& file) try {
  return jpeg_xl_header(beginning_of_stream(FileSource(file.path), *file.pixels.encapsulated)).bits;
} catch (const BrokenInput&) {
  return std::nullopt;  // decoding it will say what is wrong
}

void note_stream_without_sign(DicomFile& file) {
  const DicomPixels& pixels = file.pixels;
  if (!(pixels.is_jpeg2000() || pixels.is_jpeg_xl()) || !pixels.encapsulated || !pixels.is_signed) return;
  try {
    // Those of JPEG XL never have one.
    if (pixels.is_jpeg2000() &&
        jpeg2000_header(beginning_of_stream(FileSource(file.path), *file.pixels.encapsulated)).is_signed)
      return;
    file.notes.miss(
        "PixelRepresentation",
        "its samples have a sign (PixelRepresentation), but those of its code stream have none; the "
        "highest of their bits is read as the sign, which not all programs do");
  } catch (const BrokenInput&) {
    return;  // decoding it will say what is wrong
  }
}

std::optional<bool> has_lossy_stream(const std::string& path, const DicomPixels& pixels) {
  const bool is_jpeg_ls =
      pixels.syntax == "1.2.840.10008.1.2.4.80" || pixels.syntax == "1.2.840.10008.1.2.4.81";
  if (!pixels.is_jpeg2000() && !pixels.is_jpeg_xl() && !is_jpeg_ls) return std::nullopt;
  try {
    const std::vector<std::byte> stream = beginning_of_stream(FileSource(path), *pixels.encapsulated);
    if (pixels.is_jpeg2000()) return !jpeg2000_header(stream).is_lossless;
    if (pixels.is_jpeg_xl())
      return jpeg_xl_header(stream).has_own_colors ? std::nullopt : std::optional(true);
    const auto error = error_of_jpeg_ls(stream);
    return error ? std::optional(*error > 0) : std::nullopt;
  } catch (const BrokenInput&) {
    return std::nullopt;  // decoding it will say what is wrong
  }
}

namespace {

/// The number of bytes in a segment of RLE when it is unpacked; those below `count` become the bytes at
/// `out`, `step` bytes apart. Zeros that fill up the segment do not count.
std::size_t unpack(std::span<const std::byte> segment, std::size_t count, std::size_t step, std::byte* out) {
  std::size_t done = 0;
  const auto put = [&](std::byte byte) {
    if (done < count) out[done * step] = byte;
    ++done;
  };
  const auto is_zero = [](std::byte byte) { return byte == std::byte{0}; };
  for (std::size_t i = 0; i < segment.size();) {
    if (done == count && std::ranges::all_of(segment.subspan(i), is_zero)) break;
    const auto control = static_cast<int>(static_cast<std::int8_t>(segment[i++]));
    if (control >= 0) {
      for (int n = 0; n <= control && i < segment.size(); ++n) put(segment[i++]);
    } else if (control != -128 && i < segment.size()) {
      for (int n = 0; n <= -control; ++n) put(segment[i]);
      ++i;
    }
  }
  return done;
}

}  // namespace

std::optional<JpegFrame> jpeg_frame(std::span<const std::byte> beginning) {
  const auto at = [&](std::size_t i) { return std::to_integer<int>(beginning[i]); };
  const auto number = [&](std::size_t i) { return at(i) << 8 | at(i + 1); };
  for (std::size_t i = 2; i + 10 <= beginning.size() && at(i) == 0xFF;) {
    const int marker = at(i + 1);
    if (marker == 0xFF) {  // a marker may have more of these in front
      ++i;
      continue;
    }
    // C4, C8 and CC are other segments among the frame headers.
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC)
      return JpegFrame{at(i + 4), number(i + 5), number(i + 7), at(i + 9)};
    i += 2 + static_cast<std::size_t>(number(i + 2));
  }
  return std::nullopt;
}

void decode_rle(std::span<const std::byte> stream, std::size_t size, std::size_t count, std::byte* out) {
  constexpr std::size_t head = 64;
  const auto number = [&](std::size_t i) { return load_little_endian<std::uint32_t>(stream.data() + 4 * i); };
  if (stream.size() < head) throw BrokenInput("the RLE stream ends too soon");
  if (number(0) != size)
    throw BrokenInput("the RLE stream has samples of {} bytes, but {} are expected", number(0), size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t begin = number(1 + i), end = i + 1 < size ? number(2 + i) : stream.size();
    if (begin < head || begin > end || end > stream.size())
      throw BrokenInput("the RLE stream is broken: its segments cannot be found");
    const std::size_t byte = std::endian::native == std::endian::little ? size - 1 - i : i;
    const std::size_t found = unpack(stream.subspan(begin, end - begin), count, size, out + byte);
    constexpr std::size_t padding = 3;  // bytes that fill up a segment may look like a few samples
    if (found < count || found - count > padding)
      throw BrokenInput("the RLE stream has {} bytes in segment {}, but {} are expected", found, i + 1,
                        count);
  }
}

}  // namespace tagrid
