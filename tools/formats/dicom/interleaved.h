// Acquisitions whose slices lie between each other: together, they would look like one volume of smaller steps.
#pragma once

#include <string>
#include <vector>

#include "tools/formats/dicom/series.h"

namespace tagrid {

/// Splits sorted slices, no two at one place, by attributes in which acquisitions differ (AcquisitionNumber,
/// EchoTime, TriggerTime ...), if slices of one value lie between those of another. Both values must have two
/// slices or more, and the ones must not just fill a hole that the others leave: acquisitions one after the
/// other are one volume, and so are slices with a value each. If all slices together are even but those of a
/// value are not, or have no value, or are a pass of MR, they stay one volume; see doubts_of_order(). In one
/// part if there is nothing to split.
std::vector<DicomPart> parted_where_interleaved(const DicomPart& part, const std::vector<DicomFile>& files);

/// Sentences on sorted slices of one volume that may be several acquisitions: slices of other times or
/// values alternate, which may also be how a volume was acquired, or their coordinate systems differ. REQUIRES: all slices have
/// places.
std::vector<std::string> doubts_of_order(const std::vector<DicomSlice>& slices,
                                         const std::vector<DicomFile>& files);

}  // namespace tagrid
