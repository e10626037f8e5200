// Compares what a .tag file and an original say of the place and the meaning of samples.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

struct GeometryComparison {
  std::vector<std::string> compared;     ///< what both say: "spacing", "origin", "rescale_slope"
  bool neither_says_anything = false;    ///< of the place of samples
  std::vector<std::string> differences;  ///< "the spacing along x is 0.5, but 0.7 in the original"
};

/// Compares NRRD header lines (see VolumeInfo) of a file with those of an original, as far as both say something: spacings,
/// directions, origin, slopes, intercepts, positions of slices. Spaces that differ in the signs of axes alone are
/// converted, and so are known units; with others, what cannot be compared is left out. Numbers may differ as much as a format that keeps them as float32, or with six digits, makes them differ: by
/// 1e-5 of a spacing or a coordinate, and by 1e-6 of a slope or an intercept. A slope or an intercept that only one of them has
/// is a difference, unless it changes nothing or the original has no place for it (`original_has_scale`). Throws BrokenInput if a line is not one of a
/// header.
GeometryComparison compare_geometry(std::string_view fields, std::string_view fields_of_original,
                                    bool original_has_scale = true);

}  // namespace tagrid
