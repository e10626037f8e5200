// What readers did not understand of a source, kept in the header lines of a volume.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/volume/volume_source.h"

namespace tagrid {

/// The keys of SourceFacts::scale_doubt and SourceFacts::not_understood. Sentences of the latter are joined by "; ".
inline constexpr std::string_view scale_doubt_key = "scale doubt", not_understood_key = "not understood";

/// Header lines for the doubts in `facts` that its header does not have yet. `names` are those of the source that begin
/// sentences: they are left out, since a file may be called otherwise later.
std::string lines_of_doubts(const SourceFacts& facts, const std::vector<std::string>& names);

/// Why it is unknown how values follow from samples, according to header lines; "" if it is known.
std::string scale_doubt_in(std::string_view nrrd_fields);

/// All doubts in header lines, for users: that of the scale first.
std::vector<std::string> doubts_in(std::string_view nrrd_fields);

}  // namespace tagrid
