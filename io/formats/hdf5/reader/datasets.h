// The data sets of HDF5 files, and which of them is meant.
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/hdf5/handle.h"
#include "stages/grid/box.h"

namespace tagrid {

/// The error of a file that cannot be read.
BrokenInput broken_hdf5(const std::string& path, std::string_view why);

/// The data set with this path; nothing if there is none.
Hdf5Handle opened_dataset(hid_t file, const std::string& name);

/// The path of the file that a data set lies in, which links may have led to; "" if it is unknown.
std::string file_of(hid_t dataset);
/// True if the data set lies in the file at `path`, or in one beside it. A file is untrusted input: its links
/// lead to files in its directory, and to no others.
bool is_in_folder_of(const std::string& path, hid_t dataset);

/// True if it is so, and if its elements are in that file, too: external storage could be any file of this
/// machine, and the library silently fills the missing parts of a virtual data set.
bool has_own_samples(const std::string& path, hid_t dataset);

/// The number of elements along each axis, the slowest one first; none if it is not an array.
std::vector<hsize_t> dims_of(hid_t dataset);

/// The size of the volume that an array of this shape is. Axes in front with one sample are left out. A data
/// set of two axes is one slice. Nothing if it is not a volume.
std::optional<Index3> volume_size(const std::vector<hsize_t>& dims);

/// "31 x 20 x 7", the fastest axis first.
std::string in_words(const std::vector<hsize_t>& dims);

/// The data set that is meant.
struct DatasetChoice {
  std::string name;  ///< its path
  std::vector<std::string> warnings;
};

/// The data set that `wanted` names, or numbers; without it, the default one of NeXus, the only one, or the
/// only signal of a NeXus group. One with several slices is preferred to single slices. Throws SeveralVolumes
/// if there are several; BrokenInput, UsageError. `path` is for messages.
DatasetChoice chosen_dataset(hid_t file, const std::string& path, const std::string& wanted);

}  // namespace tagrid
