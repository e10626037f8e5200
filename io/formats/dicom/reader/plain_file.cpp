#include "io/formats/dicom/reader/dicom_file.h"

#include <span>
#include <string_view>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/formats/dicom/reader/pixel_element.h"
#include "io/programs/stored_samples.h"

namespace tagrid {
namespace {

constexpr std::uint64_t preamble = 128 + 4;  // bytes, with the magic
constexpr std::uint64_t longest_meta = 1 << 20;
constexpr std::size_t most_kept = std::size_t{4} << 20;  // of an inflated data set
constexpr std::size_t long_head = 12;                    // bytes of an element with a length of 4 bytes
constexpr std::string_view explicit_little_endian("1.2.840.10008.1.2.1\0", 20);

using Tag = std::pair<std::uint16_t, std::uint16_t>;
constexpr Tag pixel_data = {0x7FE0, 0x0010}, group_length = {0x7FE0, 0}, offset_table = {0x7FE0, 1},
              offset_table_lengths = {0x7FE0, 2}, item = {0xFFFE, 0xE000}, sequence_end = {0xFFFE, 0xE0DD};

class Bytes {
 public:
  explicit Bytes(const std::string& path) : file_(path) {}

  std::uint64_t size() const { return file_.size(); }
  std::string at(std::uint64_t position, std::uint64_t count) const {
    if (position > size() || count > size() - position) throw NoPlainForm{"it ends too soon"};
    std::string bytes(memory_size(count), '\0');
    file_.read_at(position, std::as_writable_bytes(std::span(bytes)));
    return bytes;
  }
  template <class T>
  T number(std::uint64_t position) const {
    return load_little_endian<T>(reinterpret_cast<const std::byte*>(at(position, sizeof(T)).data()));
  }
  const ByteSource& file() const { return file_; }
  Tag tag(std::uint64_t position) const {
    return {number<std::uint16_t>(position), number<std::uint16_t>(position + 2)};
  }

 private:
  FileSource file_;
};

void store(std::string& bytes, std::size_t at, std::uint64_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) bytes[at + i] = static_cast<char>(value >> (8 * i) & 0xFF);
}

/// The head of native pixels.
std::string native_head(const std::string& vr, std::uint64_t samples) {
  std::string head(long_head, '\0');
  store(head, 0, pixel_data.first, 2);
  store(head, 2, pixel_data.second, 2);
  head.replace(4, 2, vr);
  store(head, 8, samples + samples % 2, 4);
  return head;
}

/// The meta information with another transfer syntax; `end` receives the byte after it.
std::string meta_of_plain_form(const Bytes& bytes, std::uint64_t& end) {
  std::string meta;
  std::optional<std::size_t> length_at;
  bool has_syntax = false;
  std::uint64_t at = preamble, counted_from = preamble;
  for (; bytes.tag(at).first == 0x0002; at = end) {
    const std::string vr = bytes.at(at + 4, 2);
    const bool is_long = vr == "OB" || vr == "OW" || vr == "UN" || vr == "UT" || vr == "SQ";
    const std::uint64_t head = is_long ? long_head : 8;
    const std::uint64_t length =
        is_long ? bytes.number<std::uint32_t>(at + 8) : bytes.number<std::uint16_t>(at + 6);
    end = at + head + length;
    if (end > longest_meta) throw NoPlainForm{"its meta information is too long"};
    std::string element = bytes.at(at, head + length);
    if (const std::uint16_t number = bytes.tag(at).second; number == 0x0000 && length == 4) {
      length_at = meta.size() + head;
      counted_from = end;
    } else if (number == 0x0010) {
      has_syntax = true;
      element.resize(head);
      store(element, 6, explicit_little_endian.size(), 2);
      element += explicit_little_endian;
    }
    meta += element;
  }
  if (!has_syntax) throw NoPlainForm{"it does not give its transfer syntax"};
  // A wrong one stays as it is.
  if (length_at && bytes.number<std::uint32_t>(counted_from - 4) == end - counted_from)
    store(meta, *length_at, meta.size() - *length_at - 4, 4);
  return meta;
}

/// Where the element of the pixels begins, or elements before it that describe nothing but its fragments.
std::uint64_t begin_of_pixels(const Bytes& bytes, const DicomFile& file) {
  std::uint64_t begin = *file.pixels.encapsulated - long_head;
  if (bytes.tag(begin) != pixel_data || bytes.number<std::uint32_t>(begin + 8) != unknown_length)
    throw NoPlainForm{"its pixels do not begin as fragments do"};
  const std::uint64_t table = long_head + 8 * file.frames.size();
  for (const auto& [tag, size] :
       {std::pair(offset_table_lengths, table), {offset_table, table}, {group_length, std::uint64_t{12}}})
    if (begin >= size && bytes.tag(begin - size) == tag) begin -= size;
  return begin;
}

/// The byte after the fragments.
std::uint64_t end_of_fragments(const Bytes& bytes, const DicomFile& file) {
  std::uint64_t at = *file.pixels.encapsulated;
  while (bytes.tag(at) == item) at += 8 + std::uint64_t{bytes.number<std::uint32_t>(at + 4)};
  if (bytes.tag(at) != sequence_end) throw NoPlainForm{"its fragments do not end as they should"};
  return at + 8;
}

/// What lies around the samples of an inflated data set.
struct InflatedDataset {
  std::string before, behind;
};

/// Inflates the bytes of a file from `begin` to its end, and leaves out `samples` bytes from byte `at` of the
/// result on. Takes little memory: it keeps at most `most_kept` bytes.
InflatedDataset inflated_dataset(const std::string& path, std::uint64_t begin, std::uint64_t at,
                                 std::uint64_t samples) {
  InflatedDataset dataset;
  std::uint64_t position = 0;
  const auto take = [&](std::span<const char> bytes) {
    while (!bytes.empty()) {
      const bool is_before = position < at, is_behind = position >= at + samples;
      const std::uint64_t end = is_before ? at : is_behind ? position + bytes.size() : at + samples;
      const std::size_t n = std::min<std::uint64_t>(bytes.size(), end - position);
      if (is_before) dataset.before.append(bytes.data(), n);
      if (is_behind) dataset.behind.append(bytes.data(), n);
      if (dataset.before.size() + dataset.behind.size() > most_kept)
        throw NoPlainForm{"its attributes are too many"};
      position += n;
      bytes = bytes.subspan(n);
    }
  };
  FileBytes file(path);
  file.seek(begin);
  CompressedBytes stream(file, Compression::deflate);
  std::string bytes(std::size_t{1} << 16, '\0');
  try {
    while (const std::size_t count = stream.read(reinterpret_cast<std::byte*>(bytes.data()), bytes.size()))
      take(std::span(bytes).first(count));
  } catch (const BrokenInput&) {
    throw NoPlainForm{"its deflated data set is damaged, or ends too soon"};
  }
  if (position < at + samples) throw NoPlainForm{"its deflated data set ends too soon"};
  return dataset;
}

/// The pieces of a file whose data set is deflated. All of its bytes stay as they are, but for the transfer
/// syntax.
std::vector<PlainPiece> pieces_of_inflated(const DicomFile& file, std::size_t number,
                                           std::uint64_t& samples_at) {
  const Bytes bytes(file.path);
  const std::uint64_t samples = file.frames.size() * file.pixels.frame_bytes();
  if (bytes.at(preamble - 4, 4) != "DICM") throw NoPlainForm{"it has no meta information"};
  std::uint64_t end_of_meta = preamble;
  const std::string meta = meta_of_plain_form(bytes, end_of_meta);
  if (*file.pixels.inflated < end_of_meta + long_head) throw NoPlainForm{"its pixels cannot be found"};
  const InflatedDataset dataset =
      inflated_dataset(file.path, end_of_meta, *file.pixels.inflated - end_of_meta, samples);
  const std::string vr = dataset.before.substr(dataset.before.size() - 8, 2);  // OB or OW
  if (!dataset.before.ends_with(native_head(vr, samples)))
    throw NoPlainForm{"its pixels do not begin as native ones do"};
  samples_at = preamble + meta.size() + dataset.before.size();
  return {PlainPiece::stretch(number, 0, preamble), PlainPiece::given(meta + dataset.before),
          PlainPiece::samples(samples), PlainPiece::given(dataset.behind)};
}

std::vector<PlainPiece> pieces_of(const DicomFile& file, std::size_t number, std::uint64_t& samples_at) {
  const Bytes bytes(file.path);
  const std::uint64_t samples = file.frames.size() * file.pixels.frame_bytes();
  if (bytes.at(preamble - 4, 4) != "DICM") throw NoPlainForm{"it has no meta information"};
  if (samples >= unknown_length - 1) throw NoPlainForm{"its samples are more than native ones can be"};
  std::uint64_t end_of_meta = preamble;
  const std::string meta = meta_of_plain_form(bytes, end_of_meta);
  const std::uint64_t begin = begin_of_pixels(bytes, file);
  if (begin < end_of_meta) throw NoPlainForm{"its pixels cannot be found"};
  const std::string head = native_head(file.pixels.allocated > 8 ? "OW" : "OB", samples);
  samples_at = preamble + meta.size() + (begin - end_of_meta) + head.size();
  return {PlainPiece::stretch(number, 0, preamble),
          PlainPiece::given(meta),
          PlainPiece::stretch(number, end_of_meta, begin),
          PlainPiece::given(head),
          PlainPiece::samples(samples),
          PlainPiece::given(std::string(samples % 2, '\0')),
          PlainPiece::stretch(number, end_of_fragments(bytes, file), bytes.size())};
}

}  // namespace

bool may_have_wider_streams(const DicomFile& file) {
  if (!file.pixels.is_jpeg2000()) return false;
  try {
    const Bytes bytes(file.path);
    const std::uint64_t stream = first_stream(bytes.file(), *file.pixels.encapsulated);
    constexpr std::uint64_t precision_at = 42;  // SOC, SIZ and the fields before Ssiz
    return (bytes.number<std::uint8_t>(stream + precision_at) & 0x7F) + 1 > file.pixels.stored;
  } catch (const NoPlainForm&) {
    return true;
  } catch (const BrokenInput&) {
    return true;
  }
}

ReaderPlainFile plain_dicom_file(const DicomFile& file, std::size_t number, std::uint64_t& samples_at) {
  ReaderPlainFile plain;
  if (file.pixels.offset) {
    samples_at = *file.pixels.offset;
    plain.pieces = {PlainPiece::stretch(number, 0, FileSource(file.path).size())};
    return plain;
  }
  try {
    plain.compression = file.pixels.syntax_name;
    plain.pieces = file.pixels.inflated ? pieces_of_inflated(file, number, samples_at)
                                        : pieces_of(file, number, samples_at);
  } catch (const NoPlainForm& none) {
    plain.why_not = none.why;
  }
  return plain;
}

}  // namespace tagrid
