// Where the samples of a volume lie in its files, if they lie there plainly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace tagrid {

/// How integers become samples: sample = (the low bits of the integer) + add. Scanners store some volumes so.
struct StoredBits {
  int bits = 0;            ///< how many low bits count; 0: all
  bool is_signed = false;  ///< The highest of these bits is a sign. Without effect if all count.
  std::int32_t add = 0;

  bool changes_nothing() const { return bits == 0 && add == 0; }
  bool operator==(const StoredBits&) const = default;
};

/// Slices that follow each other in a volume, and lie at equal distances in a file. Samples have the size of the type of
/// the volume, x fastest.
struct SliceRun {
  std::size_t file = 0;      ///< its number among the files of the volume
  std::uint64_t offset = 0;  ///< byte of the file at which the first slice begins
  std::int64_t slices = 1;
  std::uint64_t step = 0;  ///< bytes from the beginning of a slice to that of the next one
  bool big_endian = false;
  StoredBits stored = {};
  /// Bytes from the beginning of a row to that of the next one in the file, at least those of a row; 0: one row follows another.
  std::uint64_t row_step = 0;
  bool bottom_up = false;  ///< The last row of a slice comes first in the file. Only with a row_step.

  bool operator==(const SliceRun&) const = default;
};

/// The rows of a slice.
struct SliceRows {
  std::uint64_t bytes = 0;  ///< of a row
  std::int64_t count = 1;
};

/// Bytes from the beginning of a slice of `run` to its end; nothing if they are more than 2^64.
inline std::optional<std::uint64_t> span_of_slice(const SliceRun& run, const SliceRows& rows) {
  std::uint64_t span = 0;
  if (__builtin_mul_overflow(static_cast<std::uint64_t>(rows.count - 1),
                             run.row_step == 0 ? rows.bytes : run.row_step, &span) ||
      __builtin_add_overflow(span, rows.bytes, &span))
    return std::nullopt;
  return span;
}

/// The byte after the last sample of `run`; nothing if that is beyond all files.
inline std::optional<std::uint64_t> end_of_run(const SliceRun& run, const SliceRows& rows) {
  const auto span = span_of_slice(run, rows);
  std::uint64_t end = 0;
  if (!span || __builtin_mul_overflow(static_cast<std::uint64_t>(run.slices - 1), run.step, &end) ||
      __builtin_add_overflow(end, run.offset, &end) || __builtin_add_overflow(end, *span, &end))
    return std::nullopt;
  return end;
}

/// Where row `y` of a slice lies, from the beginning of the slice on.
inline std::uint64_t place_of_row(const SliceRun& run, const SliceRows& rows, std::int64_t y) {
  return static_cast<std::uint64_t>(run.bottom_up ? rows.count - 1 - y : y) *
         (run.row_step == 0 ? rows.bytes : run.row_step);
}

}  // namespace tagrid
