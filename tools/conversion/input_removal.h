// --rm: the input goes when its output is known to be good.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"
#include "pipeline/encode/options.h"

namespace tagrid {

/// The files that --rm will remove. Throws UsageError where the input is no file or the output is none that
/// stays; with `advice` on what to do then.
std::vector<std::string> removable_tag(const std::string& input, const std::string& output,
                                       const char* advice);

/// The same of a volume; also refuses files that hold bytes that are not encoded.
std::vector<std::string> removable_volume(const std::string& input, const SourceDescription& source,
                                          const std::string& output, const char* advice);

/// What else decides on whether an encoding may take the place of a volume.
struct Replacement {
  double max_error = 0;     ///< of any voxel; negative: no bound
  bool headerless = false;  ///< the command said how the samples lie
  bool trusted = false;     ///< and means it: --trust-description
};
/// Throws UsageError where too much would be lost with the volume: nothing bounds the error, or samples are
/// changed of which only the command said what they are. A wrong description costs nothing without loss, but
/// within a bound of 5 a number with its bytes in the wrong order may be off by 1280.
void require_replaceable(const std::string& input, const Replacement& by, const char* advice);
/// Whether a volume that is encoded with these options comes back within a bound.
bool has_bound(const EncodeOptions& options);
/// The same of options alone: throws UsageError where they give no bound. `option` asks for the removal.
void refuse_without_bound(const EncodeOptions& options, const std::string& option);

/// Removes them. Throws WorldError.
void remove_files(const std::vector<std::string>& files);

}  // namespace tagrid
