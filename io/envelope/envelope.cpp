#include "io/envelope/envelope.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/envelope/plain_bytes.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/samples/stored_bits.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

constexpr std::uint64_t step = 1 << 18;  // bytes of a file that are read at once: complete samples

/// Passes the bytes [begin, end) of a file in steps.
template <class Use>
void read_stretch(PlainBytes& source, std::uint64_t begin, std::uint64_t end, Use use) {
  std::vector<std::byte> bytes;
  for (; begin < end; begin += bytes.size()) {
    bytes.resize(std::min(step, end - begin));
    source.read_at(begin, bytes);
    use(bytes);
  }
}

void leave_only_spare(const StoredBits& stored, std::size_t size, std::span<std::byte> samples) {
  with_bits_of(size, [&]<class Bits>(Bits) {
    const BitsThatCount<Bits> bits(stored);
    change_each<Bits>(samples, [&](Bits integer) { return static_cast<Bits>(integer & ~bits.used); });
  });
}

bool has_spare(const SlicesInFile& slices, std::size_t size) {
  return slices.run.stored.bits > 0 && static_cast<std::size_t>(slices.run.stored.bits) < 8 * size;
}

/// Whether look_at_content() reads a file to its end: for its checksum, or for its spare bits.
bool is_content_read(const SourceFiles& source, bool exact, std::size_t number) {
  if (!PlainBytes(source.pieces[number], *source.opened).is_complete()) return false;
  const std::size_t size = size_of(source.shape.type);
  return exact || std::ranges::any_of(source.files[number].slices,
                                      [&](const auto& slices) { return has_spare(slices, size); });
}

std::vector<std::byte> description_of(const EnvelopeFile& file) {
  FieldWriter out;
  out.put(static_cast<std::uint16_t>(file.name.size()));
  out.put_bytes(std::as_bytes(std::span(file.name)));
  out.put(file.size);
  out.put(static_cast<std::uint8_t>((file.checksum ? 1 : 0) | (file.is_changed ? 2 : 0)));
  if (file.checksum) out.put(*file.checksum);
  out.put(static_cast<std::uint32_t>(file.slices.size()));
  for (const auto& [first, run, spare] : file.slices) {
    out.put(static_cast<std::uint64_t>(first));
    out.put(static_cast<std::uint64_t>(run.slices));
    out.put(run.offset);
    out.put(run.step);
    out.put(static_cast<std::uint8_t>((run.big_endian ? 1 : 0) | (run.stored.is_signed ? 2 : 0) |
                                      (run.row_step != 0 ? 4 : 0) | (run.bottom_up ? 8 : 0)));
    out.put(static_cast<std::uint8_t>(run.stored.bits));
    out.put(static_cast<std::uint8_t>(spare));
    out.put(run.stored.add);
    if (run.row_step != 0) out.put(run.row_step);
  }
  return std::move(out.bytes());
}

}  // namespace

void look_at_content(SourceFiles& source, bool exact, std::size_t number) {
  EnvelopeFile& file = source.files[number];
  PlainBytes content(source.pieces[number], *source.opened);
  const std::size_t size = size_of(source.shape.type);
  if (!content.is_complete()) {
    // Samples will be stored as most programs do it.
    for (SlicesInFile& slices : file.slices)
      if (has_spare(slices, size))
        slices.spare = slices.run.stored.is_signed ? SpareBits::sign : SpareBits::zero;
    return;
  }
  if (!is_content_read(source, exact, number)) return;
  RunningChecksum checksum;
  std::vector<SpareBitsSeen> seen(file.slices.size());
  for_each_stretch(file, source.shape, [&](std::uint64_t begin, std::uint64_t end, const auto* slices) {
    read_stretch(content, begin, end, [&](std::span<std::byte> bytes) {
      checksum.add(bytes);
      if (slices == nullptr || !has_spare(*slices, size)) return;
      swap_if_not_native(bytes.data(), bytes.size() / size, size, slices->run.big_endian);
      look_at_spare(slices->run.stored, size, bytes,
                    seen[static_cast<std::size_t>(slices - file.slices.data())]);
    });
  });
  for (std::size_t i = 0; i < seen.size(); ++i)
    file.slices[i].spare = seen[i].zero ? SpareBits::zero : seen[i].sign ? SpareBits::sign : SpareBits::kept;
  if (exact) file.checksum = checksum.value();
}

double times_read_for_envelope(const SourceFiles& source, bool exact) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < source.files.size(); ++i) {
    const bool is_read = is_content_read(source, exact, i);
    for (const SlicesInFile& slices : source.files[i].slices)
      bytes += (std::uint64_t{is_read} + (slices.spare == SpareBits::kept)) *
               static_cast<std::uint64_t>(slices.run.slices) * source.shape.slice_bytes();
  }
  return static_cast<double>(bytes) / static_cast<double>(source.shape.bytes());
}

void write_envelope(const SourceFiles& source, const PutBytes& put,
                    const std::function<void(std::size_t)>& next_file) {
  const std::size_t size = size_of(source.shape.type);
  FieldWriter beginning;
  beginning.put(static_cast<std::uint64_t>(source.files.size()));
  beginning.put(static_cast<std::uint16_t>(source.compression.size()));
  beginning.put_bytes(std::as_bytes(std::span(source.compression)));
  put(beginning.bytes());
  for (std::size_t i = 0; i < source.files.size(); ++i) {
    if (next_file) next_file(i);
    const EnvelopeFile& file = source.files[i];
    PlainBytes bytes_of_file(source.pieces[i], *source.opened);
    put(description_of(file));
    for_each_stretch(file, source.shape, [&](std::uint64_t begin, std::uint64_t end, const auto* slices) {
      if (slices != nullptr && slices->spare != SpareBits::kept) return;
      read_stretch(bytes_of_file, begin, end, [&](std::span<std::byte> bytes) {
        if (slices != nullptr) {
          const bool big_endian = slices->run.big_endian;
          swap_if_not_native(bytes.data(), bytes.size() / size, size, big_endian);
          leave_only_spare(slices->run.stored, size, bytes);
          swap_if_not_native(bytes.data(), bytes.size() / size, size, big_endian);
        }
        put(bytes);
      });
    });
  }
}

EnvelopeReader::EnvelopeReader(std::string name, const SampleShape& shape, bool exact, NextBlock next_block,
                               bool compares_names)
    : name_(std::move(name)),
      shape_(shape),
      exact_(exact),
      compares_names_(compares_names),
      next_block_(std::move(next_block)),
      slices_left_(shape.dims.z) {}

void EnvelopeReader::fail(const std::string& what) const {
  throw BrokenInput("{}: the envelope of its source files: {}", name_, what);
}

std::span<const std::byte> EnvelopeReader::ahead() {
  while (position_ == block_.size()) {
    position_ = 0;
    if (next_block_(block_)) continue;
    block_.clear();
    return {};
  }
  return std::span(block_).subspan(position_);
}

template <class Use>
void EnvelopeReader::take(std::uint64_t size, Use use) {
  while (size > 0) {
    const auto next = ahead();
    if (next.empty()) fail("it ends too soon");
    const std::size_t n = std::min<std::uint64_t>(size, next.size());
    use(next.first(n));
    position_ += n;
    size -= n;
  }
}

std::vector<std::byte> EnvelopeReader::taken(std::size_t size) {
  std::vector<std::byte> all;
  take(size, [&](std::span<const std::byte> bytes) { all.insert(all.end(), bytes.begin(), bytes.end()); });
  return all;
}

template <class T>
T EnvelopeReader::number() {
  return load_little_endian<T>(taken(sizeof(T)).data());
}

bool EnvelopeReader::next_file(EnvelopeFile& file) {
  if (!std::exchange(started_, true)) read_beginning();
  if (files_left_ == 0) {
    if (slices_left_ != 0) fail(fmt::format("{} slices have no place", slices_left_));
    if (!ahead().empty()) fail("bytes follow its last file");
    if (has_changed_ == compression_.empty()) fail("it does not agree with its files on what was compressed");
    return false;
  }
  --files_left_;
  file = {};
  read_name(file);
  file.size = number<std::uint64_t>();
  if (file.size > std::uint64_t{1} << 62) fail("a file is too large");
  const auto flags = number<std::uint8_t>();
  const bool has_checksum = (flags & 1) != 0;
  file.is_changed = (flags & 2) != 0;
  has_changed_ = has_changed_ || file.is_changed;
  if (flags > 3) fail("an unknown kind of file");
  if (has_checksum ? !exact_ : exact_ && !file.is_changed)
    fail("a file has no checksum, or one that it must not have");
  if (has_checksum) file.checksum = number<std::uint64_t>();
  const auto runs = number<std::uint32_t>();
  std::uint64_t end = 0, samples = 0;
  for (std::uint32_t i = 0; i < runs; ++i) {
    file.slices.push_back(read_slices(end));
    samples += static_cast<std::uint64_t>(file.slices.back().run.slices) * shape_.slice_bytes();
  }
  if (end > file.size) fail("a slice lies beyond the end of a file");
  if (file.size - samples > other_bytes_left_) fail("too many bytes that are not samples");
  other_bytes_left_ -= file.size - samples;
  return true;
}

void EnvelopeReader::read_beginning() {
  files_left_ = number<std::uint64_t>();
  if (files_left_ == 0 || files_left_ > most_files(shape_)) fail("an impossible number of files");
  other_bytes_left_ = most_other_bytes(shape_, files_left_);
  const auto size = number<std::uint16_t>();
  if (size > longest_compression_name) fail("the name of a compression is too long");
  const std::vector<std::byte> text = taken(size);
  compression_.assign(reinterpret_cast<const char*>(text.data()), text.size());
}

std::string compression_in(const std::string& name, std::span<const std::byte> beginning) {
  constexpr std::size_t before = 8 + 2;  // the number of files, and the length
  const std::size_t size =
      beginning.size() < before ? beginning.size() : load_little_endian<std::uint16_t>(beginning.data() + 8);
  if (beginning.size() < before + size)
    throw BrokenInput(name + ": the envelope of its source files: it ends too soon");
  return {reinterpret_cast<const char*>(beginning.data()) + before, size};
}

void EnvelopeReader::read_name(EnvelopeFile& file) {
  const auto size = number<std::uint16_t>();
  if (size > longest_envelope_name) fail("a name is too long");
  const std::vector<std::byte> name = taken(size);
  file.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  if (!is_relative_name(file.name)) fail("the name of a file would leave the directory");
  if (!compares_names_) return;
  // No two files, and no file and directory, have the same name.
  const auto below = names_.lower_bound(file.name + "/");
  bool is_taken =
      !names_.insert(file.name).second || (below != names_.end() && below->starts_with(file.name + "/"));
  for (std::size_t end = file.name.find('/'); end != file.name.npos; end = file.name.find('/', end + 1))
    is_taken = is_taken || names_.contains(file.name.substr(0, end));
  if (is_taken) fail("two files have the same name");
}

/// Reads a run, whose slices begin at byte `end` of the file or later; `end` becomes their end.
SlicesInFile EnvelopeReader::read_slices(std::uint64_t& end) {
  SlicesInFile slices;
  SliceRun& run = slices.run;
  slices.first_slice = static_cast<std::int64_t>(number<std::uint64_t>());
  run.slices = static_cast<std::int64_t>(number<std::uint64_t>());
  run.offset = number<std::uint64_t>();
  run.step = number<std::uint64_t>();
  const auto flags = number<std::uint8_t>();
  run.big_endian = (flags & 1) != 0;
  run.stored.is_signed = (flags & 2) != 0;
  run.stored.bits = number<std::uint8_t>();
  const auto spare = number<std::uint8_t>();
  const bool has_rows = (flags & 4) != 0;
  run.bottom_up = (flags & 8) != 0;
  if (flags > 15 || spare > 2 || (run.bottom_up && !has_rows)) fail("an unknown way to store samples");
  slices.spare = static_cast<SpareBits>(spare);
  run.stored.add = number<std::int32_t>();
  const SliceRows rows = shape_.rows();
  if (has_rows) {
    run.row_step = number<std::uint64_t>();
    if (run.row_step < rows.bytes) fail("rows that overlap");
  }

  const bool is_integer = !is_float_type(shape_.type) && size_of(shape_.type) <= 4;
  if (run.stored.bits > (is_integer ? static_cast<int>(8 * size_of(shape_.type)) : 0) ||
      (run.stored.add != 0 && !is_integer))
    fail("an impossible number of bits");
  if (spare != 0 && run.stored.bits == 0) fail("spare bits where there are none");
  const std::int64_t first = slices.first_slice;
  if (first < 0 || first >= shape_.dims.z || run.slices < 1 || run.slices > shape_.dims.z - first)
    fail("a slice that the volume does not have");
  const auto span = span_of_slice(run, rows), behind = end_of_run(run, rows);
  if (run.offset < end || !span || !behind || run.step < *span)
    fail("slices that overlap, or lie beyond the end of a file");
  end = *behind;
  // Every slice has one place, so there are no more runs than slices.
  if (run.slices > slices_left_) fail("a slice has two places");
  slices_left_ -= run.slices;
  if (slices_.empty()) slices_.resize(memory_size(static_cast<std::uint64_t>(shape_.dims.z)));
  for (std::int64_t z = first; z < first + run.slices; ++z) {
    if (slices_[static_cast<std::size_t>(z)]) fail("a slice has two places");
    slices_[static_cast<std::size_t>(z)] = true;
  }
  return slices;
}

void EnvelopeReader::read_other_bytes(
    const EnvelopeFile& file, const std::function<void(std::uint64_t, std::span<const std::byte>)>& use) {
  for_each_stretch(file, shape_, [&](std::uint64_t begin, std::uint64_t end, const SlicesInFile* slices) {
    if (slices != nullptr && slices->spare != SpareBits::kept) return;
    take(end - begin, [&](std::span<const std::byte> bytes) {
      use(begin, bytes);
      begin += bytes.size();
    });
  });
}

namespace {

/// Of an allocation, besides its bytes.
constexpr std::uint64_t allocation = 16;
constexpr std::uint64_t of_text = sizeof(std::string) + allocation;
/// A run, as it is described and as it is found by its slices; the vectors may have twice the room.
constexpr std::uint64_t of_run = 4 * sizeof(SlicesInFile) + allocation;
/// What a description has of a file besides its name, and of a run.
constexpr std::uint64_t file_bytes = 32, run_bytes = 48;

/// Bytes of the largest block of an envelope.
std::uint64_t block_bytes(std::uint64_t bytes) { return std::min(bytes, std::uint64_t{1} << 20); }

/// All bytes of files that are not samples, at most.
std::uint64_t other_bytes(const SourceFacts& facts) {
  const SampleShape shape{facts.info.dims, facts.info.type};
  // The files of a plain form are not made for this.
  if (facts.places.empty()) return facts.files.size() << 16;
  const std::uint64_t all = size_of_files(facts.files);
  return std::min(all - std::min(all, shape.bytes()), most_other_bytes(shape, facts.files.size()));
}

}  // namespace

EnvelopeSize envelope_size(const std::string& name, const SampleShape& shape, bool exact,
                           NextBlock next_block) {
  EnvelopeReader reader(name, shape, exact, std::move(next_block), false);
  EnvelopeSize size;
  for (EnvelopeFile file; reader.next_file(file);) {
    reader.read_other_bytes(file, [](std::uint64_t, std::span<const std::byte>) {});
    ++size.files;
    size.name_bytes += file.name.size();
    size.runs += file.slices.size();
    size.bytes += file_bytes + file.name.size() + run_bytes * file.slices.size() + file.size;
    for (const SlicesInFile& slices : file.slices)
      size.bytes -= static_cast<std::uint64_t>(slices.run.slices) * shape.slice_bytes();
  }
  return size;
}

EnvelopeSize envelope_size(const SourceFacts& facts) {
  EnvelopeSize size;
  size.files = facts.files.size();
  for (const std::string& file : facts.files) size.name_bytes += file.size();
  // In a plain form, every slice may be a run.
  size.runs = facts.places.empty() ? static_cast<std::uint64_t>(facts.info.dims.z) : facts.places.size();
  size.bytes = size.files * file_bytes + size.name_bytes + size.runs * run_bytes + other_bytes(facts);
  return size;
}

std::uint64_t memory_of_files(const EnvelopeSize& size) {
  // The files, a copy of them for the result, and the set of their names; vectors may have twice the room.
  constexpr std::uint64_t file = 4 * sizeof(EnvelopeFile) + 4 * of_text + 64;
  // A block, packed and unpacked.
  return size.files * file + 5 * size.name_bytes + 2 * size.runs * of_run + 4 * block_bytes(size.bytes);
}

std::uint64_t memory_of_source_files(const SourceFacts& facts) {
  if (facts.places.empty() && !facts.plain_form) return 0;
  const EnvelopeSize size = envelope_size(facts);
  // Paths of the source and of its plain form, whole paths, names, and the set of names; pieces.
  constexpr std::uint64_t file =
      2 * (sizeof(PlainFile) + sizeof(EnvelopeFile) + sizeof(std::vector<PlainPiece>)) + 8 * of_text + 64;
  // A block, three times, and the tables of zstd for one of its size.
  const std::uint64_t block = block_bytes(size.bytes), writing = 4 * block + 16 * std::bit_ceil(block);
  // A file has many pieces if it has many slices: pages with their tags.
  const std::uint64_t pieces =
      facts.plain_form ? std::max(size.files, size.runs) * (8 * (sizeof(PlainPiece) + allocation) + 600)
                       : size.files * 2 * sizeof(PlainPiece);
  return size.files * file + pieces + 8 * size.name_bytes + size.runs * (of_run + 2 * sizeof(SliceRun)) +
         writing;
}

}  // namespace tagrid
