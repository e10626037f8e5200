// What the code stream of an image says of a loss, whatever the attributes of its file say.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "io/files/byte_source.h"
#include "tools/formats/dicom/dicom_file.h"

namespace tagrid {

/// The byte at which the code stream of the first frame begins, after the table of offsets. `fragments`: the
/// byte at which that table begins. The file may end before the stream. Throws BrokenInput if it ends before
/// the table.
std::uint64_t first_stream(const ByteSource& file, std::uint64_t fragments);

/// Whether the code stream of the first frame was made with a loss: by the irreversible wavelet of JPEG 2000 (9-7), or as
/// near-lossless JPEG-LS. Nothing if the stream does not say, for it is damaged, or of another kind. Throws WorldError.
/// REQUIRES: pixels.encapsulated.
std::optional<bool> has_lossy_stream(const std::string& path, const DicomPixels& pixels);

}  // namespace tagrid
