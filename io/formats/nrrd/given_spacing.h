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

/// Gives `volume` this spacing. What its files state already must agree (six digits), and only what they leave
/// open is filled in, unless `given` overrides them. Then directions keep their directions and get the new
/// lengths, the origin stays where it is, positions of slices are dropped, and a warning says so. Key-value
/// pairs record both, except for samples without a header, which have no other spacing. Throws UsageError if the
/// files state another spacing.
void give_spacing(VolumeSource& volume, const GivenSpacing& given);

/// Header lines of an original whose spacing was overridden in a volume with the lines `fields`: those of the
/// original with the same spacing. The lines of the original as they are, if nothing was overridden, if they
/// record it themselves, or if the original has another spacing than the one that was overridden.
std::string with_overridden_spacing(std::string_view fields_of_original, std::string_view fields);

/// What header lines should say about the size of a voxel and do not; see SourceFacts::missing_of_voxel_size.
/// `needs_unit`: files of this format usually state a unit.
std::string missing_of_voxel_size(const Geometry& geometry, bool needs_unit);

}  // namespace tagrid
