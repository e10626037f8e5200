// Volumes whose slices are Windows bitmaps.
#pragma once

#include <memory>
#include <string>

#include "io/programs/serve_reader.h"

namespace tagrid {

/// Opens a folder of slices, in the order of their numbers, or a file as a volume of one slice. Of several series, the option
/// "series" chooses one.
std::unique_ptr<ServedVolume> open_bmp(const std::string& path, const ReaderOptions& options);

}  // namespace tagrid
