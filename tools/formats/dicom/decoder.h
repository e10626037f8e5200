// Samples that must be decoded: JPEG, JPEG-LS, JPEG 2000, RLE, deflate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "tools/formats/dicom/dicom_file.h"

namespace tagrid {

/// The frames of one file.
class DicomDecoder {
 public:
  /// Throws BrokenInput and WorldError. `file` must outlive this.
  explicit DicomDecoder(const DicomFile& file);
  ~DicomDecoder();

  const DicomFile& file() const;
  /// The bytes of samples, of a file that is not encapsulated.
  std::uint64_t bytes_of_samples() const;
  /// Decodes a frame to the machine's byte order, as it is stored: file().pixels.frame_bytes() bytes. Returns
  /// the number of bits that count, which a code stream may say differently than the file. Throws
  /// BrokenInput.
  int read_frame(std::size_t frame, std::byte* out);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tagrid
