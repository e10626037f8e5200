// Samples that lie uncompressed in files, slice by slice.
#pragma once

#include <memory>
#include <vector>

#include "io/volume/slice_run.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// The volume of `facts`, whose slices lie in its files as the runs say, from front to back. The traits follow from
/// that: any rows can be read. Throws WorldError if a file cannot be opened, or is not a regular one; BrokenInput if it
/// ends before its slices do. REQUIRES: only integers have stored bits; the runs have info.dims.z slices, and the numbers of their files exist.
std::unique_ptr<VolumeSource> placed_samples(SourceFacts facts, std::vector<SliceRun> runs);

}  // namespace tagrid
