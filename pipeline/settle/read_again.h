// Reads samples before they are encoded, from sources that do not allow random access.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

/// A temporary copy of samples that is about to be made. It has no name, and so is gone with this process.
struct SampleCopy {
  std::string volume;  ///< what the user calls it
  std::string folder;
  std::uint64_t bytes = 0;
};
using TellOfCopy = std::function<void(const SampleCopy& copy)>;

/// How a source must be readable before it is encoded.
enum class Look {
  once,            ///< not at all, or by what the source allows
  again,           ///< from front to back, and then once more
  a_few_rows,      ///< some rows, from front to back
  all_rows_often,  ///< rows of bricks, many times
};

/// True if `look` needs a copy of the samples. Reader programs can read any slice again. A copy is
/// therefore made only for a pipe, for a compressed stream, and for rows that are read often if the
/// user gave a spool.
bool needs_copy(const SourceTraits& traits, Look look, const Resources& resources);

/// The same volume from a copy of its samples in `folder`: the spool of `resources`, or else the
/// usual one for temporary files. `tell` is called before. Throws WorldError if the folder does not
/// have enough space. Also throws it if the folder is in memory and was not named by the user, and
/// the copy and `besides` would exceed the memory limit.
std::unique_ptr<VolumeSource> copied(std::unique_ptr<VolumeSource> source, const std::string& folder,
                                     const Resources& resources, std::uint64_t besides,
                                     const TellOfCopy& tell);

/// A view of a source without a copy, from which any rows can be read. It keeps up to `kept` slices. `source` must
/// outlive it.
std::unique_ptr<VolumeSource> view_of_rows(VolumeSource& source, std::int64_t kept);

}  // namespace tagrid
