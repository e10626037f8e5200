// Messages of libtiff, which it passes to handlers for the entire process.
#pragma once

#include <tiffio.h>

#include <string>

#include "tools/formats/tiff/remarks.h"

namespace tagrid {

/// Of the last call.
extern std::string last_reason, last_warning;
/// What it said of the tags of the last directory that it could not use.
extern TiffRemarks of_tags;

/// From now on, libtiff tells these.
void listen_to_libtiff();

/// The number of a tag, or its default; `otherwise` if it has none. REQUIRES: T is the type in which libtiff
/// gives it.
template <class T>
T value_of(TIFF* tiff, std::uint32_t tag, T otherwise) {
  T value = otherwise;
  return TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : otherwise;
}

}  // namespace tagrid
