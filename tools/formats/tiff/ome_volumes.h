// The volumes of OME-TIFF files, of which several may be one set.
#pragma once

#include <string>
#include <vector>

#include "tools/formats/tiff/ome.h"
#include "tools/formats/tiff/tiff_volumes.h"

namespace tagrid {

/// Adds the volumes that `xml` describes: each channel and each moment of each image. `path` is the file that
/// was named, `pages` are its pages; `has_xml` is false if the description lies in a companion. Files of the
/// set are looked for beside it, and nowhere else. Throws BrokenInput, with Problem::slices_missing if files
/// or planes are missing; with `gaps_ok`, such slices are left out, and said.
void add_ome(const std::string& path, const std::vector<TiffPage>& pages, const OmeXml& xml, bool has_xml,
             bool gaps_ok, TiffVolumes& volumes);

/// The file of this name beside `path`: a description is untrusted input. Throws BrokenInput for a name that
/// leads elsewhere.
std::string beside(const std::string& path, const std::string& name);

/// For a file without OME-XML whose name suggests that it has some: the file beside it whose OME-XML names
/// it, "" if there is none. Some programs describe a set in its first file only.
std::string file_that_names(const std::string& path);

}  // namespace tagrid
