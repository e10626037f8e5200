// The noise of a volume.
#pragma once

#include "io/volume/volume_source.h"

namespace tagrid {

/// The standard deviation of the noise of a volume: that of its samples from planes that fit small blocks, where most
/// blocks agree (see stages/survey/survey.h). Reads a sample of the volume, a quarter of a million blocks. 0 if no block is
/// noisy. REQUIRES: source.traits().any_rows.
double noise_of(VolumeSource& source);

}  // namespace tagrid
