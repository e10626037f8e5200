// The fragments of the element of the samples (DICOM PS3.5, A.4), and the code streams of frames in them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/formats/dicom/reader/dicom_file.h"

namespace tagrid {

/// Bytes of the tag and the length of an item.
inline constexpr std::uint64_t item_head = 8;

/// The content of a fragment, or of the table of offsets, which is the first item.
struct FragmentItem {
  std::uint64_t begin = 0, length = 0;  ///< bytes of the file

  std::uint64_t end() const { return begin + length; }
};

/// The item whose head is at `at`; nothing if there is none, or not all of it. Throws WorldError.
std::optional<FragmentItem> item_at(const ByteSource& file, std::uint64_t at);

/// The items from byte `begin` on, after the table of offsets. Throws BrokenInput if they are not complete, do
/// not end as they should, or are too many; and WorldError.
std::vector<FragmentItem> fragments_from(const ByteSource& file, std::uint64_t begin);

/// True if a fragment begins as a code stream of the syntax of these pixels does, as far as streams can be told
/// from what follows them: JPEG, JPEG-LS, JPEG 2000 and JPEG XL.
bool begins_stream(const ByteSource& file, const FragmentItem& item, const DicomPixels& pixels);

/// The code streams of the frames of one file.
class CodeStreams {
 public:
  /// Finds the fragments of all frames: a table of offsets says where they begin, or each is a fragment, or
  /// their first bytes show it. Throws BrokenInput, without the name of the file, and WorldError. REQUIRES:
  /// pixels.encapsulated. `file` must outlive this.
  explicit CodeStreams(const DicomFile& file);

  /// The fragments of a frame, one after the other. Throws BrokenInput, as above, and WorldError.
  std::vector<std::byte> stream_of(std::size_t frame) const;

 private:
  FileSource bytes_;
  std::vector<FragmentItem> items_;
  std::vector<std::size_t> first_;  ///< the item with which a frame begins; empty if that is not known
  std::size_t frames_ = 0;
};

}  // namespace tagrid
