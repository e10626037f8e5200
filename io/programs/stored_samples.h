// Numbers and slices as files store them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/volume/sample_places.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// REQUIRES: at least one number.
inline double median(std::vector<double> numbers) {
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::ranges::nth_element(numbers, middle);
  return *middle;
}

/// The type of integers of this many bytes; nothing if there is none.
constexpr std::optional<SampleType> integer_type(std::size_t bytes, bool is_signed) {
  if (bytes == 1) return is_signed ? SampleType::int8 : SampleType::uint8;
  if (bytes == 2) return is_signed ? SampleType::int16 : SampleType::uint16;
  if (bytes == 4) return is_signed ? SampleType::int32 : SampleType::uint32;
  return std::nullopt;
}

/// The unsigned number in at most 8 bytes.
inline std::uint64_t number_in(std::span<const std::byte> bytes, bool big_endian) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    value = value << 8 | std::to_integer<std::uint64_t>(bytes[big_endian ? i : bytes.size() - 1 - i]);
  return value;
}

/// True if `next`, a slice, goes on where `run` ends, which then has it.
inline bool joins(SliceRun& run, const SliceRun& next) {
  if (run.file != next.file || run.stored != next.stored ||
      next.offset != run.offset + static_cast<std::uint64_t>(run.slices) * run.step)
    return false;
  ++run.slices;
  return true;
}

/// Thrown if a file has no plain form; the reason is a sentence.
struct NoPlainForm {
  std::string why;
};

}  // namespace tagrid
