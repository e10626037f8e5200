// Words that help users to distinguish series.
#pragma once

#include <string>
#include <vector>

#include "tools/formats/dicom/parts.h"
#include "tools/formats/dicom/series.h"

namespace tagrid {

/// "512 x 512 x 30, CT, Lung, AXIAL, EchoTime 2.46".
std::string in_words(const DicomPart& part, const std::vector<DicomFile>& files);

/// Adds to equal texts what distinguishes their series: direction, spacing, numbers of images and others. Texts of one
/// UID that differ in the number of slices alone count as equal.
void make_distinct(std::vector<DicomSeries>& series, const std::vector<DicomFile>& files);

}  // namespace tagrid
