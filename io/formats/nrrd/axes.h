// The axes of NRRD files: more or fewer than three, and axes of which a header gives the ends.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

struct ThreeAxes {
  Index3 dims;
  std::string nrrd_fields;  ///< the header lines, in which fields of axes have three values
};

/// The three axes of a volume with these sizes, fastest first. Of more than three, some with a single sample
/// are left out: first those that are not in space (their direction is "none", or their kind is not one of
/// space), then the fastest, then the slowest. Two axes are a slice: the third one has unknown spacing or, if
/// the others have directions, a unit vector at right angles to them. Lines are those of
/// VolumeInfo::nrrd_fields. Throws BrokenInput if too many axes have several samples, and if a field does not
/// have as many values as there are axes.
ThreeAxes three_axes(const std::vector<std::int64_t>& sizes, std::string_view nrrd_fields);

/// True if an axis of this kind may be one of space: "none" and "???" say nothing.
bool is_spatial_kind(std::string_view kind);

/// The numbers of "(a,b,c)"; nothing if it is not like that.
std::optional<std::vector<double>> vector_of(std::string_view value);
/// The parts of "(a,b,c) none (d,e,f)"; nothing if a vector does not end.
std::optional<std::vector<std::string_view>> vectors_in(std::string_view value);

/// The header lines (see VolumeInfo::nrrd_fields), with the spacing of each axis that has none but an axis
/// min and an axis max, as teem has it: (max - min) / samples, or (max - min) / (samples - 1) if the axis is
/// centered on nodes. teem, too, takes an axis of unknown centering for one of cells. Lines with directions
/// stay as they are. Throws as geometry_of() does.
std::string with_spacing_of_ends(const std::string& nrrd_fields, const Index3& dims);

}  // namespace tagrid
