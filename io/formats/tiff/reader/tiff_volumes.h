// The volumes in TIFF files: what programs wrote of their order, and what follows from pages and names.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/tiff/reader/descriptions.h"
#include "io/formats/tiff/reader/ome.h"
#include "io/formats/tiff/reader/tiff_file.h"
#include "io/formats/tiff/reader/tiff_page.h"
#include "io/programs/serve_reader.h"

namespace tagrid {

/// A slice: a page of one of the files.
struct TiffPlane {
  std::size_t file = 0;
  TiffPage page;
};

/// One of the volumes in the files, with its planes from front to back.
struct TiffVolume {
  Choice choice;
  std::vector<TiffPlane> planes;
  Geometry geometry;
  TiffRemarks remarks;
};

/// All volumes in some files, and what is known of all of them.
struct TiffVolumes {
  std::string name;  ///< for messages: the path that the user gave
  std::vector<std::string> files;
  std::vector<TiffVolume> list;
  std::optional<ImageJCalibration> calibration;  ///< of all samples
  std::string loss;  ///< before the files were written; "" if they say nothing of it
  KeyValues pairs;
  TiffRemarks remarks;
  std::vector<std::string> warnings;  ///< sentences that begin with the name of a file
};

/// The volumes in a file: its pages, in the order that ImageJ or OME-XML gives them, or in that of the file.
/// Each channel and each moment is a volume. If OME-XML says that the file is one of a set, those of the set.
/// With `gaps_ok`, slices may be missing there. Throws BrokenInput, WorldError.
TiffVolumes volumes_of_file(const std::string& path, bool gaps_ok);

/// The volume whose slices are these files, with one page each. Its own remarks are those on its spacing.
TiffVolumes volume_of_files(const std::vector<std::string>& paths);

/// Volume `number` of `volumes`, which are not needed any more.
std::unique_ptr<ServedVolume> slices_of(TiffVolumes volumes, std::size_t number);

/// The name of a channel and a moment, where there are several.
Choice choice_of(std::int64_t channel, std::int64_t channels, std::int64_t time, std::int64_t times);

using SpacingOfPage = std::function<Geometry(const TiffPage&, TiffRemarks&)>;

/// spacing_of(), by the resolution of a page alone.
inline Geometry spacing_of_resolutions(const TiffPage& page, TiffRemarks& remarks) {
  return spacing_of(page, remarks);
}

/// The spacing that the pages of a volume state by `spacing_of_page`; unknown, with a warning, if
/// they state different ones. Pages without a resolution, or with 1 x 1, do not state a spacing:
/// programs may write it into the first page only. REQUIRES: there are planes.
Geometry common_spacing(const std::vector<TiffPlane>& planes, TiffRemarks& remarks,
                        const SpacingOfPage& spacing_of_page);

/// "24 x 16 uint16".
std::string in_words(const TiffPage& page);

/// Adds the volumes that `xml` describes: each channel and each moment of each image. `path` is the file that
/// was named, `pages` are its pages; `has_xml` is false if the description lies in a companion. Files of the
/// set are looked for beside it, and nowhere else. Throws BrokenInput, with Problem::slices_missing if files
/// or planes are missing; with `gaps_ok`, such slices are left out, and reported.
void add_ome(const std::string& path, const std::vector<TiffPage>& pages, const OmeXml& xml, bool has_xml,
             bool gaps_ok, TiffVolumes& volumes);

/// The file of this name beside `path`: a description is untrusted input. Throws BrokenInput for a name that
/// leads elsewhere.
std::string beside(const std::string& path, const std::string& name);

/// For a file without OME-XML whose name suggests that it has some: the file beside it whose OME-XML names
/// it, "" if there is none. Some programs describe a set in its first file only.
std::string file_that_names(const std::string& path);

}  // namespace tagrid
