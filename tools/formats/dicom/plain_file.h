// A DICOM file with encapsulated samples as it would be with native ones.
#pragma once

#include <cstddef>
#include <cstdint>

#include "io/programs/reader_conversation.h"
#include "tools/formats/dicom/dicom_file.h"

namespace tagrid {

/// The plain form of a file, which is number `number` among those of its volume, without the places of
/// slices: the same data set in Explicit VR Little Endian. All attributes stay as they are, byte for byte,
/// except the transfer syntax and what describes the compressed pixels. `samples_at` receives the byte at
/// which the first frame begins. A file whose samples lie plainly is its own plain form. Throws WorldError.
/// REQUIRES: pixels.offset, pixels.encapsulated or pixels.inflated.
ReaderPlainFile plain_dicom_file(const DicomFile& file, std::size_t number, std::uint64_t& samples_at);

/// True if the code streams of a file may have more bits than it says, as those of some JPEG 2000 encoders
/// do. Native samples have no room for numbers that need them. REQUIRES: pixels.encapsulated.
bool may_have_wider_streams(const DicomFile& file);

}  // namespace tagrid
