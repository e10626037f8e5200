// Images that are the slices of one volume: several at one place are moments, echoes, segments, ...
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "io/formats/dicom/reader/dicom_file.h"
#include "io/programs/serve_reader.h"

namespace tagrid {

/// A frame of a file, by their numbers.
struct DicomSlice {
  std::size_t file = 0, frame = 0;
};

/// Slices of one volume.
struct DicomPart {
  std::vector<DicomSlice> slices;
  std::string told_by;  ///< from the other parts: "EchoTime 2.46"; "" if it is the only one
};

/// The value of an attribute that sorts as a number if it is one.
struct DicomValue {
  double number = std::numeric_limits<double>::infinity();
  std::string_view text;  ///< "" if there is none

  bool is_number() const { return number != std::numeric_limits<double>::infinity(); }
  bool operator<(const DicomValue& other) const;
};

/// The value of the attribute `moment` in a frame, or of its file. It refers to `files`.
DicomValue value_of(const std::vector<DicomFile>& files, const DicomSlice& slice, std::size_t moment);

const DicomFrame& frame_of(const std::vector<DicomFile>& files, const DicomSlice& slice);

bool has_place(const DicomFrame& frame);
/// The place of a frame along the normal of its image, in mm. REQUIRES: position and orientation.
double along_normal(const DicomFrame& frame);

/// The first slice that is where the next one is; slices.size() if there is none. REQUIRES: sorted slices.
std::size_t first_of_two(const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& files);

/// Sorted slices, split by what distinguishes images at one place; in one part if nothing does.
std::vector<DicomPart> parted(const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& files);

/// Parts of equal values of these attributes, by their values. Slices keep their order.
std::vector<DicomPart> parted_by(const std::vector<std::size_t>& moments,
                                 const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& files);

/// Attributes in which two slices differ, and their values: "ContentTime (101500 and 101530)"; "" if there
/// are none.
std::string differences(const DicomSlice& a, const DicomSlice& b, const std::vector<DicomFile>& files);

/// The slices of a volume, from front to back. Its name is that of lasting_name_of().
struct DicomSeries {
  Choice choice;
  std::vector<DicomSlice> slices;
  /// The short name of all images of which these are a part; it does not select this part. "" if
  /// these are all images.
  std::string name_of_all = {};
};

/// Sorts all frames into series: by the UID of the series, size, type of samples, orientation and spacing;
/// and if that puts several images at one place, also by moment, echo, acquisition and others. No two choices
/// have equal texts. The slices of a series are sorted by their positions along the normal of the images, or
/// by their numbers if they have no positions.
std::vector<DicomSeries> series_of(const std::vector<DicomFile>& files);

/// Sets the geometry of the volume; adds the positions of all slices as a pair if their steps differ, and
/// warnings. Throws BrokenInput if two slices are at the same position, or if only some have a position.
/// `name` is for messages.
void set_places(const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& files,
                const std::string& name, ServedVolume& volume);

}  // namespace tagrid
