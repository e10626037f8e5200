// The files of a directory, or those that a DICOMDIR names, before they are sorted into series.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/formats/dicom/reader/dicom_file.h"
#include "io/formats/dicom/reader/series.h"

namespace tagrid {

/// A file that looks like an image and cannot be read.
struct UnreadableImage {
  std::string path, why;  ///< "is empty"
  std::string series;     ///< the UID of its series; "" if it is not known
};

/// All files at a path.
struct ImageFiles {
  std::vector<DicomFile> images;
  std::vector<UnreadableImage> unreadable;
  std::vector<std::string> others;  ///< names of files that have no image
};

/// Reads the headers of all files at `path`: a file, a directory, or a DICOMDIR. A file that cannot be read
/// looks like an image if it is of DICOM, or if its name has the extension of DICOM or is like those of
/// images: the same extension, or the same texts between numbers. If there is no image, the first
/// unreadable file is the error. Throws BrokenInput and WorldError.
ImageFiles image_files_at(const std::string& path);

/// True if the names of two files are alike as those of images of a series are: the same extension, or the same texts
/// between numbers.
bool may_be_of_series(std::string_view own, std::string_view other);

/// The unreadable files that may be images of a series: files that name the series, and other files whose
/// names are like those of its files, or unlike those of all images.
std::vector<UnreadableImage> unreadable_in(const DicomSeries& series, const ImageFiles& files);

/// Notes about files at `path` that are not in the volume: unreadable and other ones, and, if `path` is a
/// file, another image of its series in the same directory. With `gaps_ok`, slices that cannot be read are
/// left out of the series; without it, they are BrokenInput.
std::vector<std::string> warnings_about(const std::string& path, const ImageFiles& files, DicomSeries& series,
                                        bool gaps_ok);

}  // namespace tagrid
