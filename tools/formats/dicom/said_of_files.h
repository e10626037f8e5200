// Sentences about the files of a volume.
#pragma once

#include <string>
#include <vector>

#include "tools/formats/dicom/dicom_file.h"

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

}  // namespace tagrid
