// Geometry of data sets whose axes are named by letters.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/hdf5/reader/conventions.h"

namespace tagrid {

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
