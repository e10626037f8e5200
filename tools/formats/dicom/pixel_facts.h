// How the samples of a data set are stored, and whether they can be read.
#pragma once

#include "tools/formats/dicom/attributes.h"
#include "tools/formats/dicom/dicom_file.h"

namespace tagrid {

/// Sets file.pixels as far as attributes say it: all but the places of samples. Notes attributes by which
/// samples may mean something else. `syntax` is the UID that the file gives, or that its bytes look like.
/// Throws BrokenInput.
void read_pixel_facts(DcmDataset& dataset, const std::string& syntax, DicomFile& file);

/// Sets pixels.unsupported if samples cannot be read. REQUIRES: file.frames.
void require_readable(DcmDataset& dataset, DicomFile& file);

/// What DicomPixels::lossy is. It does not name the syntax, so it stays the same for a decoded file.
std::string lossy_compression(DcmDataset& dataset, const DicomFile& file);

}  // namespace tagrid
