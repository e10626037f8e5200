// The axes of NRRD files: more or fewer than three, and axes of which a header gives the ends.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "io/metadata/metadata.h"
#include "stages/grid/box.h"

namespace tagrid {

struct ThreeAxes {
  Index3 dims;
  MetadataEntries entries;  ///< in which fields of axes have three values
};

/// The three axes of a volume with these sizes, fastest first. Of more than three, some with a single sample
/// are left out: first those that are not in space (their direction is "none", or their kind is not one of
/// space), then the fastest, then the slowest. Two axes are a slice: the third one has unknown spacing or, if
/// the others have directions, a unit vector at right angles to them. Throws BrokenInput if too many axes have
/// several samples, and if a field does not have as many values as there are axes.
ThreeAxes three_axes(const std::vector<std::int64_t>& sizes, const MetadataEntries& entries);

/// The parts of "(a,b,c) none (d,e,f)"; nothing if a vector does not end.
std::optional<std::vector<std::string_view>> vectors_in(std::string_view value);

/// The description, with the spacing of each axis that has none but an axis min and an axis max, as teem has it:
/// (max - min) / samples, or (max - min) / (samples - 1) if the axis is centered on nodes. teem, too, takes an
/// axis of unknown centering for one of cells. Descriptions with directions stay as they are.
Metadata with_spacing_of_ends(const Metadata& metadata, const Index3& dims);

}  // namespace tagrid
