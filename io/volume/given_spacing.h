// Spacings that users give for volumes whose files do not state them, or state wrong ones.
#pragma once

#include <string>
#include <string_view>

#include "io/volume/volume_source.h"

namespace tagrid {

/// The key that records a spacing that was given, and the one that records what a file said instead:
/// "10 10 25 um".
inline constexpr std::string_view given_spacing_key = "given spacing",
                                  overridden_spacing_key = "overridden spacing";

/// Sets the spacing of `volume`. What its files state must agree with `given` to six digits, and
/// only what they do not state is added; throws UsageError if they disagree. If `given` overrides
/// the files, it replaces their spacing instead, with a warning: directions are scaled to the new
/// distances, the origin stays where it is, and positions of slices are dropped. Key-value pairs
/// record the given spacing and the one that was replaced, except for samples without a header,
/// which have no other spacing.
void give_spacing(VolumeSource& volume, const GivenSpacing& given);

/// The description of an original, to compare it with that of a volume whose spacing was overridden: with the
/// spacing of that volume. Returns the original unchanged if nothing was overridden, if it records it itself, or
/// if it does not have the spacing that was overridden.
Metadata with_overridden_spacing(const Metadata& original, const Metadata& ours);

/// What a geometry does not state about the voxel size, but should; see
/// SourceFacts::missing_of_voxel_size. `needs_unit`: files of this format usually state a unit.
std::string missing_of_voxel_size(const Geometry& geometry, bool needs_unit);

}  // namespace tagrid
