// Directories whose files are slices, or equal parts, of volumes that tagrid itself reads.
#pragma once

#include <string>
#include <vector>

#include "io/text/numbered_names.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Those of `files`, all in one directory, that are the series which source.series names or numbers, or the only
/// one, in the order of the numbers in their names. Throws UsageError if one of several must be chosen, or if there
/// is no such one; BrokenInput if there are no files, or if two have the same number.
NumberedFiles chosen_series(const std::string& folder, std::vector<std::string> files,
                            const SourceDescription& source);

/// Throws BrokenInput if numbers are missing, and `source` does not accept that.
void require_no_gap(const std::string& folder, const NumberedFiles& files, const SourceDescription& source);

/// Both: a series without a gap, unless that is accepted.
NumberedFiles series_of_files(const std::string& folder, std::vector<std::string> files,
                              const SourceDescription& source);

}  // namespace tagrid
