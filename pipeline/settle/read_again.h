// Reads samples before they are encoded, from sources that do not allow random access.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/memory/resources.h"
#include "pipeline/settle/settle.h"

namespace tagrid {

/// As settle(), for any volume. If it cannot be read as often as that takes, a copy takes its place. Throws as copied().
EncodeJob settle_any(const EncodeOptions& options, std::unique_ptr<VolumeSource>& volume,
                     const Settling& settling);

/// True if `look` needs a copy of the samples. Reader programs can read any slice again. A copy is
/// therefore made only for a pipe, for a compressed stream, and for rows that are read often if the
/// user gave a spool.
bool needs_copy(const SourceTraits& traits, Look look, const Resources& resources);

/// The same volume from a copy of its samples, in the spool of `resources` or else in the usual directory for
/// temporary files. `tell` is called before. Throws WorldError if the folder does not
/// have enough space. Also throws it if the folder is in memory and was not named by the user, and
/// the copy and `besides` would exceed the memory limit.
std::unique_ptr<VolumeSource> copied(std::unique_ptr<VolumeSource> source, const Resources& resources,
                                     std::uint64_t besides, const TellOfCopy& tell);

}  // namespace tagrid
