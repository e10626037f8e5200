// Folders whose files are slices.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/programs/serve_reader.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"

namespace tagrid {

/// The files in a directory as series by the numbers in their names. Only names with one of the extensions
/// (in lower case: ".tif") count, none that begins with a dot, and not the preview beside a SkyScan
/// reconstruction. Throws BrokenInput if there are no such files; WorldError.
std::vector<NumberedFiles> series_of_slices(const std::string& folder,
                                            const std::vector<std::string>& extensions);

/// One of several series, for the user.
Choice choice_of(const NumberedFiles& files);

/// Throws BrokenInput if numbers are missing, without the option "gaps-ok".
void require_no_gap(const std::string& folder, const NumberedFiles& files, const ReaderOptions& options);

/// The files of one series in a directory, in the order of their numbers; of several series, that which the
/// option "series" chooses. Throws as the functions above; SeveralVolumes, UsageError.
NumberedFiles slice_files(const std::string& folder, const std::vector<std::string>& extensions,
                          const ReaderOptions& options);

/// Says which numbers are missing in a directory that is read all the same.
void add_warning_of_gaps(const std::string& folder, const NumberedFiles& files,
                         std::vector<std::string>& warnings);

/// Bytes in a file after the samples of a slice, where nothing else belongs.
struct BytesAfter {
  std::string path;
  std::uint64_t bytes = 0;
};
/// Reports that they are not part of the volume, for all files at once.
void add_bytes_after(const std::vector<BytesAfter>& files, std::vector<std::string>& warnings);

/// The spacing within a slice that follows from its resolution: in mm, unknown along z.
struct SpacingOfSlice {
  Geometry geometry;
  std::string remark;  ///< a sentence without the name of a file: why there is none; "" if it is clear
};
/// `x` and `y` are the numbers of samples in `millimeters`. Print resolutions, such as 72 or 300
/// dpi, are not a voxel size; neither is a resolution of 1, which is a placeholder.
SpacingOfSlice spacing_of_resolution(double x, double y, double millimeters);

/// The resolutions that the slices of one volume state.
class ResolutionOfSlices {
 public:
  /// Those of the next slice along x and y; 0 if it does not state one.
  void add(double x, double y);
  /// Sets the spacing that follows from them as above, if all slices agree; otherwise adds a warning. `file` is the
  /// name of the first slice.
  void describe(const std::string& file, double millimeters, Geometry& geometry,
                std::vector<std::string>& warnings) const;

 private:
  std::optional<std::pair<double, double>> first_;
  bool are_same_ = true;
};

/// What a SkyScan (Bruker) log in the directory of the slices says: the size of a voxel, and all its fields
/// as pairs.
struct SliceLog {
  std::string path;  ///< "" if there is none
  Geometry geometry;
  KeyValues pairs;
  std::vector<std::string> warnings;  ///< of numbers in it that cannot be read, without its name
};
/// The log of these slices: the one whose name the names of the slices begin with, otherwise the only one
/// with a reconstruction.
SliceLog log_of_slices(const std::string& folder, const NumberedFiles& slices);
/// Adds a log to what is known of a volume, and its file after those of the slices.
void include_log(SliceLog log, Geometry& geometry, KeyValues& pairs, std::vector<std::string>& files,
                 std::vector<std::string>& warnings);

/// What the names of the files say, as a pair for VolumeInfo.
std::pair<std::string, std::string> pair_of(const NumberedFiles& files);

/// Opens a directory of slices in the order of their numbers, or a file as a volume of one slice; see
/// slice_files(). Volume is a ServedVolume that is made of the paths of its slices.
template <class Volume>
std::unique_ptr<ServedVolume> open_slices(const std::string& path, const std::vector<std::string>& extensions,
                                          const ReaderOptions& options) {
  std::error_code unknown;
  if (!std::filesystem::is_directory(path_of(path), unknown))
    return std::make_unique<Volume>(std::vector{path});
  NumberedFiles files = slice_files(path, extensions, options);
  const auto names = pair_of(files);
  SliceLog log = log_of_slices(path, files);
  auto volume = std::make_unique<Volume>(std::move(files.paths));
  volume->pairs.push_back(names);
  add_warning_of_gaps(path, files, volume->warnings);
  include_log(std::move(log), volume->geometry, volume->pairs, volume->files, volume->warnings);
  return volume;
}

}  // namespace tagrid
