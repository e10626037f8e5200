// --rm: the input goes when its output is known to be good.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

/// The files that --rm will remove. Throws UsageError where the input is no file or the output is none that
/// stays; with `advice` on what to do then.
std::vector<std::string> removable_tag(const std::string& input, const std::string& output,
                                       const char* advice);

/// The same of a volume; also refuses files that hold bytes that are not encoded.
std::vector<std::string> removable_volume(const std::string& input, const SourceDescription& source,
                                          const std::string& output, const char* advice);

/// Removes them. Throws WorldError.
void remove_files(const std::vector<std::string>& files);

}  // namespace tagrid
