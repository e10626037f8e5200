// The frames of a data set: places, spacing, rescaling, and what distinguishes them.
#pragma once

#include "tools/formats/dicom/attributes.h"
#include "tools/formats/dicom/dicom_file.h"

namespace tagrid {

/// Sets file.frames, file.moments, and notes on what cannot be read. `most` frames can be in the file. Throws
/// BrokenInput.
void read_frames(DcmDataset& dataset, std::uint64_t most, DicomFile& file);

/// True for doses of radiotherapy, which have a scale of their own.
bool is_dose(DcmDataset& dataset);

}  // namespace tagrid
