// How series and their volumes are called: names that stay when files of other volumes come or go, and words
// for users.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/formats/dicom/reader/series.h"

namespace tagrid {

/// "1.2.840.113619.2.5-3f2a9c1b": the UID of the series, and a checksum of what tells its volumes
/// apart: size, type of samples, orientation, spacing, and the attributes of moments.h. It depends
/// on these slices alone. Volumes of one series that differ in any of these have different names;
/// those that differ only in attributes that are not part of names have different names only with
/// `all`. REQUIRES: sorted slices, at least one.
std::string lasting_name_of(const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& files,
                            bool all = false);

/// The UID in a name that lasting_name_of() gave; "" if it cannot be one.
std::string_view uid_in(std::string_view name);

/// The slices among `slices` that have this name, by splitting them once or twice by an attribute;
/// several if the name does not tell them apart. Images of two volumes look like one volume as long
/// as they share no position, so the volume that kept them apart may be gone.
std::vector<std::vector<DicomSlice>> slices_called(const std::string& name,
                                                   const std::vector<DicomSlice>& slices,
                                                   const std::vector<DicomFile>& files);

/// "512 x 512 x 30, CT, Lung, AXIAL, EchoTime 2.46".
std::string in_words(const DicomPart& part, const std::vector<DicomFile>& files);

/// Adds to equal texts what distinguishes their series: direction, spacing, numbers of images and others.
/// Texts of one UID that differ in the number of slices alone count as equal.
void make_distinct(std::vector<DicomSeries>& series, const std::vector<DicomFile>& files);

}  // namespace tagrid
