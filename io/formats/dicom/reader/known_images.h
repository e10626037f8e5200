// The images of several series at a path, which are read once for all of them.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/dicom/reader/image_files.h"
#include "io/formats/dicom/reader/series.h"
#include "io/system/files.h"

namespace tagrid {

/// All images at a path, and their series.
struct KnownImages {
  ImageFiles files;
  std::vector<DicomSeries> series;
  /// How the files at the path were when they were read, the path itself among them; empty if nobody keeps the images
  /// for the next request.
  std::map<std::string, std::optional<FileStatus>> seen = {};

  /// True if the files of this series are as they were.
  bool are_as_before(const DicomSeries& one) const;
};

/// The images at a path. Those of several series are kept, and are not read again if the next path is the same. Files
/// that are kept had not been changed for some seconds; once a second, all of them are compared with how they were. The
/// caller compares those that it needs, and calls forget_images() if they differ. Throws as image_files_at() does.
std::shared_ptr<KnownImages> images_at(const std::string& path);
void forget_images();

}  // namespace tagrid
