// The data elements of a DICOM file as bytes: where they are, and new ones. The standard: https://dicom.nema.org, PS3.5, 7.
// Values are not interpreted, so what nobody changes stays as it is, byte for byte.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/byte_source.h"

namespace tagrid {

struct DicomTag {
  std::uint16_t group = 0, element = 0;
  auto operator<=>(const DicomTag&) const = default;
};

/// How elements are written.
struct DicomCoding {
  bool is_explicit = true;  ///< with value representations
  bool big_endian = false;
};

/// An element in a file.
struct DicomElement {
  DicomTag tag;
  std::string vr;            ///< "UI"; "" if it is implicit
  std::uint64_t begin = 0;   ///< of its head
  std::uint64_t value = 0;   ///< where its value begins
  std::uint64_t length = 0;  ///< of its value; of items without a length, all before the delimiter
  std::uint64_t end = 0;     ///< with a delimiter

  std::uint64_t value_end() const { return value + length; }
};

/// Finds elements in a file. Wrong bytes throw BrokenInput, whose message begins with the name of the file.
class DicomElements {
 public:
  /// `name` is for messages. `file` must outlive this.
  DicomElements(const ByteSource& file, std::string name);

  /// The element at `begin`, which must end before `end`.
  DicomElement at(std::uint64_t begin, std::uint64_t end, DicomCoding coding) {
    return element(begin, end, coding, 0);
  }
  /// Adds the elements of [begin, end) in order, or those up to the first one with the tag `last`.
  void add(std::vector<DicomElement>& elements, std::uint64_t begin, std::uint64_t end, DicomCoding coding,
           DicomTag last = {0xFFFF, 0xFFFF});
  /// The elements of each item of a sequence. Nothing if its value does not consist of items.
  std::optional<std::vector<std::vector<DicomElement>>> items(const DicomElement& sequence,
                                                              DicomCoding coding);
  /// The bytes [begin, end), of which there may be 64 KiB, or `most`.
  std::string bytes(std::uint64_t begin, std::uint64_t end, std::uint64_t most = 1 << 16);
  /// How elements from `begin` on are written, by the look of the first one.
  DicomCoding coding_at(std::uint64_t begin);
  DicomTag tag(std::uint64_t at, DicomCoding coding);
  /// True if a tag of items begins there.
  bool has_item_at(std::uint64_t begin, DicomCoding coding);

  [[noreturn]] void fail(std::string_view what) const;

 private:
  /// Of `count` bytes, which are there.
  std::uint64_t number(std::uint64_t at, std::size_t count, bool big_endian);
  DicomElement element(std::uint64_t begin, std::uint64_t end, DicomCoding coding, int depth);
  /// The end of items without a length: where their delimiter begins.
  std::uint64_t end_of_items(std::uint64_t at, std::uint64_t end, DicomCoding coding, int depth);
  std::uint64_t end_of_item(std::uint64_t at, std::uint64_t end, DicomCoding coding, int depth);

  const ByteSource& file_;
  std::string name_;
  std::vector<std::byte> window_;  ///< bytes from window_at_ on, which are read together
  std::uint64_t window_at_ = 0;
};

/// How the items of a sequence are written: those in an element whose VR is unknown are implicit.
inline DicomCoding coding_of_items(const DicomElement& sequence, DicomCoding coding) {
  return sequence.vr == "UN" ? DicomCoding{false, false} : coding;
}

/// An element with this value, which is a text and gets an even length, or consists of items.
std::string dicom_element(DicomTag tag, std::string_view vr, std::string value, DicomCoding coding);
/// An item of a sequence with these elements.
std::string dicom_item(std::string_view elements, DicomCoding coding);

}  // namespace tagrid
