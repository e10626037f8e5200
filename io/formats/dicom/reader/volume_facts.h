// What the files of a volume say together: their notes, the meaning of all samples, and texts that are alike.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/formats/dicom/reader/series.h"
#include "io/programs/serve_reader.h"

namespace tagrid {

/// Notes of all files, one for each thing that they are about, with the name of the volume and of the first
/// file that has it.
std::vector<std::string> said_of(const std::vector<DicomFile>& files,
                                 std::vector<DicomNote> DicomNotes::*kind, const std::string& name);

/// Notes samples of a deflated file that belong to no frame. It must be inflated for that. Throws BrokenInput
/// and WorldError.
void note_more_inflated_frames(DicomFile& file);

/// Concatenations of which files are missing.
std::vector<std::string> about_concatenations(const std::vector<DicomFile>& files, const std::string& name);

/// Attributes that all images of a scan share, and in which these files differ: they may be of several scans.
std::vector<std::string> about_several_scans(const std::vector<DicomFile>& files, const std::string& name);

/// Sets the type of samples and their rescaling, and adds pairs and warnings. Returns what is added to the
/// stored integers of each slice. `name` is for messages.
std::vector<std::int32_t> set_meaning(const std::vector<DicomSlice>& slices,
                                      const std::vector<DicomFile>& files, const std::string& name,
                                      ServedVolume& volume);

/// What all files of a volume say alike.
KeyValues texts_of(const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& files);
/// The UIDs of its images, one a slice.
std::string uids_of(const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& files);

}  // namespace tagrid
