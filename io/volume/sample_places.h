// Where the samples of a volume lie in its files, if they lie there plainly; and files in their plain form,
// as they would be if their samples were not compressed. Without the encoder, compressed samples cannot be
// restored byte for byte, but the same data set can be restored uncompressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// How integers become samples: sample = (the low bits of the integer) + add. Scanners store some volumes so.
struct StoredBits {
  int bits = 0;            ///< how many low bits count; 0: all
  bool is_signed = false;  ///< The highest of these bits is a sign. Without effect if all count.
  std::int32_t add = 0;

  bool changes_nothing() const { return bits == 0 && add == 0; }
  bool operator==(const StoredBits&) const = default;
};

/// Consecutive slices of a volume at equal distances in a file. Samples have the size of its type, x fastest.
struct SliceRun {
  std::size_t file = 0;      ///< its number among the files of the volume
  std::uint64_t offset = 0;  ///< byte of the file at which the first slice begins
  std::int64_t slices = 1;
  std::uint64_t step = 0;  ///< bytes from the beginning of a slice to that of the next one
  bool big_endian = false;
  StoredBits stored = {};
  /// Bytes from one row to the next in the file, at least those of a row; 0: one row follows another.
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
std::optional<std::uint64_t> span_of_slice(const SliceRun& run, const SliceRows& rows);

/// The byte after the last sample of `run`; nothing if that is beyond all files.
std::optional<std::uint64_t> end_of_run(const SliceRun& run, const SliceRows& rows);

/// Where row `y` of a slice lies, from the beginning of the slice on.
inline std::uint64_t place_of_row(const SliceRun& run, const SliceRows& rows, std::int64_t y) {
  return static_cast<std::uint64_t>(run.bottom_up ? rows.count - 1 - y : y) *
         (run.row_step == 0 ? rows.bytes : run.row_step);
}

/// Some bytes of a file in its plain form.
struct PlainPiece {
  enum class Kind : std::uint8_t {
    given,    ///< `bytes`
    stretch,  ///< `size` bytes of a file, from `offset` on
    content,  ///< the content of the gzip, zlib or bzip2 stream that begins there, to its end
    samples,  ///< `size` bytes of samples, which only their decoder can give
  };

  static PlainPiece given(std::string bytes) {
    return {.kind = Kind::given, .bytes = std::move(bytes), .size = {}};
  }
  static PlainPiece stretch(std::size_t file, std::uint64_t begin, std::uint64_t end) {
    return {.kind = Kind::stretch, .bytes = "", .file = file, .offset = begin, .size = end - begin};
  }
  static PlainPiece content(std::size_t file, std::uint64_t offset, std::optional<std::uint64_t> size = {}) {
    return {.kind = Kind::content, .bytes = "", .file = file, .offset = offset, .size = size};
  }
  static PlainPiece samples(std::uint64_t size) { return {.kind = Kind::samples, .bytes = "", .size = size}; }

  Kind kind = Kind::given;
  std::string bytes;
  std::size_t file = 0;  ///< its number among the files of the source
  std::uint64_t offset = 0;
  std::optional<std::uint64_t> size;  ///< without `bytes`; of a content, nothing if it is not known
};

struct PlainFile {
  std::string path;  ///< where it would lie: that of the file of the source, or beside it
  /// False if the file is one of the source as it is.
  bool is_changed = false;
  std::vector<PlainPiece> pieces;
};

struct PlainForm {
  /// How samples are compressed, for users: "gzip"; "" if unknown.
  std::string compression;
  std::vector<PlainFile> files;
  std::vector<SliceRun> places;             ///< of all samples in `files`, from front to back
  std::optional<std::string> why_not = {};  ///< a sentence if there is no plain form
  /// What users should know of the samples, and is known only after they are decoded.
  std::vector<std::string> warnings = {};
};

/// The name of a file without the ending of a compressed one: "a.nii" for "a.nii.gz", "a.raw" for "a.zraw".
std::string plain_name(std::string_view name);

}  // namespace tagrid
