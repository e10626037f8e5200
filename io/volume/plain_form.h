// The files of a source as they would be if their samples were not compressed. Without the encoder,
// compressed samples cannot be restored byte for byte, but the same data set can be restored uncompressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/volume/slice_run.h"

namespace tagrid {

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
  std::vector<SliceRun> places;  ///< of all samples in `files`, from front to back
  std::string why_not;           ///< a sentence if there is no plain form; "" if there is one
};

/// The name of a file without the ending that says that it is compressed: "a.nii" for "a.nii.gz", "a.raw" for "a.zraw".
std::string plain_name(std::string_view name);

}  // namespace tagrid
