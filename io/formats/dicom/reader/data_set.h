// What a data set says: how its samples are stored, what they mean, and the places of its frames.
#pragma once

#include "io/formats/dicom/reader/attributes.h"
#include "io/formats/dicom/reader/dicom_file.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// Sets file.pixels as far as attributes say it: all but the places of samples. Notes attributes by which
/// samples may mean something else. `syntax` is the UID that the file gives, or that its bytes look like.
/// Throws BrokenInput.
void read_pixel_facts(DcmDataset& dataset, const std::string& syntax, DicomFile& file);

/// What DicomPixels::unsupported is, as far as attributes say it. REQUIRES: file.frames.
std::string why_not_readable(DcmDataset& dataset, const DicomFile& file);

/// What DicomPixels::lossy is. It does not name the syntax, so it stays the same for a decoded file.
std::string lossy_compression(DcmDataset& dataset, const DicomFile& file);

/// Changes `rescale` as far as the item says something about it.
void read_rescale(DcmItem& item, Rescale& rescale, DicomNotes& notes);

/// The dose that a sample of 1 means. A scale that is 0 or absent gives 0.
Rescale rescale_of_dose(DcmDataset& dataset, DicomNotes& notes);

/// Notes values that do not follow from samples by `rescale`, but by a table or a real world value mapping.
void note_tables(DcmItem& dataset, DicomNotes& notes);
void note_real_world_values(DcmItem& item, const Rescale& rescale, DicomNotes& notes);

/// Sets file.frames, file.moments, and notes on what cannot be read. `most` frames can be in the file. Throws
/// BrokenInput.
void read_frames(DcmDataset& dataset, std::uint64_t most, DicomFile& file);

/// True for doses of radiotherapy, which have a scale of their own.
bool is_dose(DcmDataset& dataset);

}  // namespace tagrid
