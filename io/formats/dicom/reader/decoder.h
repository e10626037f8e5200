// Samples that must be decoded: JPEG, JPEG-LS, JPEG 2000, JPEG XL, RLE, deflate.
#pragma once

#include <dcmtk/config/osconfig.h>
// The configuration comes first.
#include <dcmtk/dcmdata/dcfcache.h>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dctk.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "io/formats/dicom/reader/dicom_file.h"
#include "io/formats/dicom/reader/fragments.h"

namespace tagrid {

/// The frames of one file.
class DicomDecoder {
 public:
  /// Throws BrokenInput and WorldError. `file` must outlive this.
  explicit DicomDecoder(const DicomFile& file);

  const DicomFile& file() const { return file_; }
  /// The bytes of samples, of a file that is not encapsulated.
  std::uint64_t bytes_of_samples() const { return pixels_->getLength(); }
  /// Decodes a frame to the machine's byte order, as it is stored: file().pixels.frame_bytes() bytes. Returns
  /// the number of bits that count, which a code stream may say differently than the file. Throws
  /// BrokenInput.
  int read_frame(std::size_t frame, std::byte* out);

 private:
  [[noreturn]] void fail(std::string_view why) const;
  DcmPixelSequence& fragments();
  Uint32 fragment_of(std::size_t frame);
  std::vector<std::byte> beginning_from(Uint32 begin, std::size_t enough);
  int read_stream(std::size_t frame, std::byte* out);
  void check_jpeg_frame(std::size_t frame);
  int read_other(std::size_t frame, std::byte* out);

  const DicomFile& file_;
  std::optional<CodeStreams> streams_;  ///< those that the library does not decode
  DcmFileFormat format_;
  DcmPixelData* pixels_ = nullptr;
  DcmFileCache cache_;
  std::size_t next_frame_ = 0;
  Uint32 next_fragment_ = 0;  ///< of next_frame_
  std::vector<std::byte> buffer_;
};

}  // namespace tagrid
