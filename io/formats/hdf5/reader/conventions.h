// Positions of samples in files of programs that store them next to the samples: ITK, openPMD, MINC
// 2, Imaris, Chimera, EMAN and CREMI.
#pragma once

#include <hdf5.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/text/foreign_number.h"
#include "stages/grid/box.h"

namespace tagrid {

/// What a convention says of a data set.
struct Convention {
  Geometry geometry;
  double slope = 1;                          ///< of the values
  bool are_axes_placed = false;              ///< the directions describe axes that are not z, y, x
  std::vector<std::string> warnings, known;  ///< `known`: the names of attributes and fields that were read
};

/// The geometry of the data set at the absolute path `name`, with these dimensions, in the file at
/// `path`. Nothing if it follows none of these conventions. If something cannot be read, the
/// positions are unknown, with a warning.
std::optional<Convention> convention_of(hid_t file, const std::string& path, const std::string& name,
                                        const Index3& dims);

/// A number that Imaris writes as a list of letters; absent if there is none.
ForeignNumber number_of_letters(hid_t object, const std::string& name);

/// True if the file is one of Imaris, whose volumes are those of "/DataSet/ResolutionLevel 0".
bool is_imaris(hid_t file);
inline constexpr const char* finest_of_imaris = "/DataSet/ResolutionLevel 0/";
/// The size of the image in a data set of Imaris, which pads images to whole chunks. Nothing if
/// there is no padding, or if the file is not one of Imaris.
std::optional<Index3> imaris_size(hid_t file, const std::string& name, const Index3& dims);

// Geometry of data sets whose axes are named by letters.

/// The vectors and the origin of a convention, for the letters x, y and z.
struct SpaceOfLetters {
  std::array<std::array<double, 3>, 3> steps = {};  ///< the vector from a sample to the next one
  std::optional<std::array<double, 3>> origin;
  std::array<std::string, 3> units;
};

/// The geometry of samples whose axes have these letters, the slowest axis first: "zyx", or another
/// order. Nothing if the letters are not x, y and z.
std::optional<Geometry> geometry_of_letters(const std::vector<std::string>& letters,
                                            const SpaceOfLetters& space);

/// openPMD (https://github.com/openPMD/openPMD-standard), versions 1 and 2. `name`: an absolute path.
std::optional<Convention> openpmd_of(hid_t file, const std::string& path, const std::string& name);
/// MINC 2 (https://en.wikibooks.org/wiki/MINC).
std::optional<Convention> minc_of(hid_t file, const std::string& path, const std::string& name);

}  // namespace tagrid
