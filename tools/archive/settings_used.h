// Whether an output is what the current options would give.
#pragma once

#include <string>

#include "io/volume/volume_source.h"
#include "tools/archive/records.h"
#include "tools/options/encoding_options.h"

namespace tagrid {

/// How the encoding of `volume` that `asked` describes differs from the one that made the output, in words:
/// "max-error was 5, now 2"; "" if it does not. Compares the settings that were used, with bounds in samples,
/// not texts: "5" and "5.0" are the same, "0.9" and "0.1" are not if a stored step is 0.1. Omitted options
/// have their defaults. Settings that follow from the samples are compared by their rules. Throws UsageError
/// if the options make no sense for the volume. `run` limits memory.
std::string difference_of(const KnownOutput& known, const OptionTexts& asked, const RunOptions& run,
                          const VolumeSource& volume);

}  // namespace tagrid
