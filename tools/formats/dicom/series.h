// Images that are the slices of one volume.
#pragma once

#include <string>
#include <vector>

#include "io/programs/serve_reader.h"
#include "tools/formats/dicom/dicom_file.h"
#include "tools/formats/dicom/parts.h"

namespace tagrid {

/// The slices of a volume, from front to back. Its name is that of lasting_name_of().
struct DicomSeries {
  Choice choice;
  std::vector<DicomSlice> slices;
};

/// Sorts all frames into series: by the UID of the series, size, type of samples, orientation and spacing;
/// and if that puts several images at one place, also by moment, echo, acquisition and others. No two choices
/// have equal texts. The slices of a series are sorted by their positions along the normal of the images, or
/// by their numbers if they have no positions.
std::vector<DicomSeries> series_of(const std::vector<DicomFile>& files);

/// Where the slices of a series lie, and what to report about that.
struct DicomPlaces {
  Geometry geometry;
  KeyValues pairs;  ///< the positions of all slices, if their steps differ
  std::vector<std::string> warnings;
};

/// Throws BrokenInput if two slices are at the same position, or if only some have a position. `name` is for
/// messages.
DicomPlaces places_of(const DicomSeries& series, const std::vector<DicomFile>& files,
                      const std::string& name);

}  // namespace tagrid
