#include "plugins/hdf5/coding.h"

#include <bit>
#include <limits>
#include <string>

namespace tagrid::hdf5 {
namespace {

constexpr unsigned layout = 2;
constexpr std::size_t most_given = 4;
constexpr unsigned big_endian_flag = 256;

[[noreturn]] void refuse(const std::string& message) { throw Error(TAGRID_INVALID_ARGUMENT, message); }

std::uint64_t joined(unsigned low, unsigned high) { return std::uint64_t{high} << 32 | low; }

double bound_of(std::span<const unsigned> numbers) {
  if (numbers.empty()) return 0;
  if (numbers.size() == 1) return numbers[0];
  return std::bit_cast<double>(joined(numbers[0], numbers[1]));
}

}  // namespace

std::size_t Chunk::sample_count() const {
  return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
         static_cast<std::size_t>(dims[2]);
}

Choice choice_of(std::span<const unsigned> numbers) {
  if (numbers.size() > most_given && numbers.size() != stored_numbers)
    refuse(
        "the filter takes none to four numbers: E, or the low and high half of a double E, the effort, and 1 "
        "if chunks are written as a whole");
  Choice choice;
  choice.max_error = bound_of(numbers);
  // False for NaN, too.
  if (!(choice.max_error >= 0 && choice.max_error <= std::numeric_limits<double>::max()))
    refuse("the largest error is not a finite number of at least 0: " + std::to_string(choice.max_error));
  if (numbers.size() > 2) {
    if (numbers[2] > TAGRID_EFFORT_BEST)
      refuse("the effort is 0 (default), 1 (fast) or 2 (best), not " + std::to_string(numbers[2]));
    choice.effort = static_cast<tagrid_effort>(numbers[2]);
  }
  if (numbers.size() > 3) {
    if (numbers[3] > 1)
      refuse("the fourth number is 0, or 1 if chunks are written as a whole, not " +
             std::to_string(numbers[3]));
    choice.whole_chunks = numbers[3] == 1;
  }
  return choice;
}

Chunk chunk_of(std::span<const unsigned> numbers) {
  if (numbers.size() != stored_numbers)
    refuse("the file has " + std::to_string(numbers.size()) + " numbers for the filter where " +
           std::to_string(stored_numbers) + " belong");
  if (numbers[4] != layout)
    refuse("the filter's numbers are of version " + std::to_string(numbers[4]) +
           ", and this one knows version " + std::to_string(layout) + ": a newer tagrid may read them");
  Chunk chunk;
  chunk.type = static_cast<tagrid_type>(numbers[5] & ~big_endian_flag);
  chunk.big_endian = (numbers[5] & big_endian_flag) != 0;
  std::uint64_t bytes = tagrid_sample_size(chunk.type);
  if (bytes == 0) refuse("the filter's numbers name no type of samples");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t samples = numbers[6 + axis];
    // HDF5 limits a chunk to less than 4 GiB.
    if (samples == 0 || samples > std::numeric_limits<std::uint32_t>::max() / bytes)
      refuse("the filter's numbers give a chunk of no size that HDF5 has");
    bytes *= samples;
    chunk.dims[axis] = static_cast<std::int64_t>(samples);
  }
  chunk.fill = joined(numbers[9], numbers[10]);
  return chunk;
}

std::array<unsigned, stored_numbers> numbers_of(const Choice& choice, const Chunk& chunk) {
  const auto bound = std::bit_cast<std::uint64_t>(choice.max_error);
  return {static_cast<unsigned>(bound),
          static_cast<unsigned>(bound >> 32),
          static_cast<unsigned>(choice.effort),
          choice.whole_chunks ? 1U : 0U,
          layout,
          static_cast<unsigned>(chunk.type) | (chunk.big_endian ? big_endian_flag : 0),
          static_cast<unsigned>(chunk.dims[0]),
          static_cast<unsigned>(chunk.dims[1]),
          static_cast<unsigned>(chunk.dims[2]),
          static_cast<unsigned>(chunk.fill),
          static_cast<unsigned>(chunk.fill >> 32)};
}

}  // namespace tagrid::hdf5
