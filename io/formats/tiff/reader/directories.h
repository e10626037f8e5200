// The directories of a TIFF file as they are stored: all fields, also those that no library knows. The
// format: Adobe, TIFF Revision 6.0, and https://libtiff.gitlab.io/libtiff/specification/bigtiff.html
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/programs/stored_samples.h"

namespace tagrid {

/// How numbers lie in a file.
struct TiffLayout {
  bool big_endian = false;
  bool is_big = false;  ///< BigTIFF: places have 8 bytes instead of 4

  std::size_t place_bytes() const { return is_big ? 8 : 4; }
  /// Appends the low `count` bytes of a number.
  void put(std::string& bytes, std::uint64_t value, std::size_t count) const {
    for (std::size_t i = 0; i < count; ++i)
      bytes += static_cast<char>(value >> (8 * (big_endian ? count - 1 - i : i)) & 0xFF);
  }
  std::uint64_t number(std::span<const std::byte> bytes) const { return number_in(bytes, big_endian); }
};

struct TiffField {
  std::uint16_t tag = 0, type = 0;
  std::uint64_t count = 0;  ///< of values
  std::uint64_t at = 0;     ///< byte of the file at which the values lie, in the directory or elsewhere

  std::uint64_t bytes() const;  ///< of all values
  std::size_t value_bytes() const;
};

struct TiffDirectory {
  std::vector<TiffField> fields;
  std::uint64_t next = 0;  ///< place of the next directory; 0: there is none
};

/// Reads what it is asked for, and believes nothing: every value lies in the file. All functions throw
/// NoPlainForm and WorldError.
class TiffDirectories {
 public:
  explicit TiffDirectories(const std::string& path);

  const TiffLayout& layout() const { return layout_; }
  std::uint64_t size() const { return file_.size(); }
  std::uint64_t first() const { return first_; }
  TiffDirectory at(std::uint64_t place) const;
  std::string bytes(std::uint64_t position, std::uint64_t count) const;
  /// The values of a field of whole numbers.
  std::vector<std::uint64_t> numbers(const TiffField& field) const;
  /// The value of a field with one whole number; `otherwise` if there is no such field.
  std::uint64_t number_of(const TiffDirectory& directory, std::uint16_t tag, std::uint64_t otherwise) const;

 private:
  std::uint64_t number(std::uint64_t position, std::size_t count) const;

  FileSource file_;
  TiffLayout layout_;
  std::uint64_t first_ = 0;
};

}  // namespace tagrid
