#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/envelope/envelope.h"
#include "io/files/errors.h"

namespace tagrid {

EnvelopeReader::EnvelopeReader(std::string name, const SampleShape& shape, NextBlock next_block)
    : name_(std::move(name)), shape_(shape), next_block_(std::move(next_block)), slices_left_(shape.dims.z) {}

void EnvelopeReader::fail(const std::string& what) const {
  throw BrokenInput(fmt::format("{}: the envelope of its source files: {}", name_, what));
}

/// Goes to the next block when all of this one was taken.
void EnvelopeReader::fill() {
  while (position_ == block_.size()) {
    position_ = 0;
    if (!next_block_(block_)) fail("it ends too soon");
  }
}

std::vector<std::byte> EnvelopeReader::take(std::size_t size) {
  std::vector<std::byte> bytes;
  while (bytes.size() < size) {
    fill();
    const std::size_t n = std::min(size - bytes.size(), block_.size() - position_);
    const auto begin = block_.begin() + static_cast<std::ptrdiff_t>(position_);
    bytes.insert(bytes.end(), begin, begin + static_cast<std::ptrdiff_t>(n));
    position_ += n;
  }
  return bytes;
}

template <class T>
T EnvelopeReader::number() {
  return load_little_endian<T>(take(sizeof(T)).data());
}

bool EnvelopeReader::next_file(EnvelopeFile& file) {
  if (!std::exchange(started_, true)) files_left_ = number<std::uint64_t>();
  if (files_left_ == 0) {
    if (slices_left_ != 0) fail(fmt::format("{} slices have no place", slices_left_));
    while (position_ == block_.size()) {
      position_ = 0;
      if (!next_block_(block_)) return false;
    }
    fail("bytes follow its last file");
  }
  --files_left_;
  file = {};
  const std::vector<std::byte> name = take(number<std::uint16_t>());
  file.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  file.size = number<std::uint64_t>();
  const auto has_checksum = number<std::uint8_t>();
  if (has_checksum > 1) fail("a flag is neither 0 nor 1");
  if (has_checksum == 1) file.checksum = number<std::uint64_t>();
  const auto runs = number<std::uint32_t>();
  for (std::uint32_t i = 0; i < runs; ++i) {
    SlicesInFile slices;
    slices.first_slice = static_cast<std::int64_t>(number<std::uint64_t>());
    slices.run.slices = static_cast<std::int64_t>(number<std::uint64_t>());
    slices.run.offset = number<std::uint64_t>();
    slices.run.step = number<std::uint64_t>();
    const auto flags = number<std::uint8_t>();
    slices.run.big_endian = (flags & 1) != 0;
    slices.run.stored.is_signed = (flags & 2) != 0;
    slices.run.stored.bits = number<std::uint8_t>();
    const auto spare = number<std::uint8_t>();
    if (flags > 3 || spare > 2) fail("an unknown way to store samples");
    slices.spare = static_cast<SpareBits>(spare);
    slices.run.stored.add = number<std::int32_t>();
    file.slices.push_back(slices);
  }
  check(file);
  return true;
}

void EnvelopeReader::check(const EnvelopeFile& file) {
  if (!is_safe_name(file.name)) fail("the name of a file would leave the folder");
  if (file.size > std::uint64_t{1} << 62) fail("a file is too large");
  const std::uint64_t slice = shape_.slice_bytes();
  const int most_bits = !is_float_type(shape_.type) && size_of(shape_.type) <= 4
                            ? static_cast<int>(8 * size_of(shape_.type))
                            : 0;
  std::uint64_t end = 0;
  for (const auto& [first, run, spare] : file.slices) {
    if (first < 0 || first >= shape_.dims.z || run.slices < 1 || run.slices > shape_.dims.z - first)
      fail("a slice that the volume does not have");
    if (run.stored.bits > most_bits || (run.stored.add != 0 && most_bits == 0))
      fail("an impossible number of bits");
    if (spare != SpareBits::zero && run.stored.bits == 0) fail("spare bits where there are none");
    std::uint64_t last = 0;
    if (run.offset < end || run.step < slice ||
        __builtin_mul_overflow(static_cast<std::uint64_t>(run.slices - 1), run.step, &last) ||
        __builtin_add_overflow(last, run.offset, &last) || __builtin_add_overflow(last, slice, &end) ||
        end > file.size)
      fail("slices that overlap, or lie beyond the end of a file");
    // Every slice is described once. Where it was described, a bit is set; there are at most as many as slices.
    if (run.slices > slices_left_) fail("a slice has two places");
    slices_left_ -= run.slices;
    if (slices_.empty()) slices_.resize(static_cast<std::size_t>(shape_.dims.z));
    for (std::int64_t z = first; z < first + run.slices; ++z) {
      if (slices_[static_cast<std::size_t>(z)]) fail("a slice has two places");
      slices_[static_cast<std::size_t>(z)] = true;
    }
  }
}

void EnvelopeReader::read_other_bytes(
    const EnvelopeFile& file, const std::function<void(std::uint64_t, std::span<const std::byte>)>& use) {
  for_each_stretch(file, shape_.slice_bytes(),
                   [&](std::uint64_t begin, std::uint64_t end, const SlicesInFile* slices) {
                     if (slices != nullptr && slices->spare != SpareBits::kept) return;
                     while (begin < end) {
                       fill();
                       const std::size_t n = std::min<std::uint64_t>(end - begin, block_.size() - position_);
                       use(begin, std::span(block_).subspan(position_, n));
                       position_ += n;
                       begin += n;
                     }
                   });
}

}  // namespace tagrid
