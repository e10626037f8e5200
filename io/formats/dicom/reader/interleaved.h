// Acquisitions whose slices are interleaved: together, they would look like one volume with smaller
// steps.
#pragma once

#include <string>
#include <vector>

#include "io/formats/dicom/reader/series.h"

namespace tagrid {

/// Splits slices by attributes in which acquisitions differ (AcquisitionNumber, EchoTime,
/// TriggerTime ...), if slices with one value lie between those with another. Both values must have
/// at least two slices, and the slices with one value must not just fill a gap between the others.
/// Acquisitions that follow one another are therefore one volume, and so are slices that each have
/// their own value. If all slices together have equal steps, but those with one value do not, have
/// no value, or are a pass of MR, they stay one volume; see doubts_of_order(). Returns one part if
/// there is nothing to split. REQUIRES: slices are sorted, and no two have the same position.
std::vector<DicomPart> parted_where_interleaved(const DicomPart& part, const std::vector<DicomFile>& files);

/// Sentences about the sorted slices of one volume that may be several acquisitions: their times or
/// values alternate, which may also be how one volume was acquired, or their coordinate systems
/// differ. REQUIRES: all slices have positions.
std::vector<std::string> doubts_of_order(const std::vector<DicomSlice>& slices,
                                         const std::vector<DicomFile>& files);

}  // namespace tagrid
