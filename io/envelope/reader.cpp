#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/envelope/envelope.h"
#include "io/errors/errors.h"

namespace tagrid {

EnvelopeReader::EnvelopeReader(std::string name, const SampleShape& shape, bool exact, NextBlock next_block,
                               bool compares_names)
    : name_(std::move(name)),
      shape_(shape),
      exact_(exact),
      compares_names_(compares_names),
      next_block_(std::move(next_block)),
      slices_left_(shape.dims.z) {}

void EnvelopeReader::fail(const std::string& what) const {
  throw BrokenInput(fmt::format("{}: the envelope of its source files: {}", name_, what));
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
  if (!is_safe_name(file.name)) fail("the name of a file would leave the directory");
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

}  // namespace tagrid
