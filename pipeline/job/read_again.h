// Samples that are looked at before they are encoded, from sources that cannot be read in any order.
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

/// How a source must be read before it is encoded.
enum class Look {
  once,            ///< not at all, or by what the source allows
  again,           ///< from front to back, and then once more
  a_few_rows,      ///< some rows, from front to back
  all_rows_often,  ///< rows of bricks, many times
};

/// True if `look` needs a copy of the samples. Reader programs give any slice again, so that a copy is made only of
/// a pipe, of a compressed stream, and if the user gives a spool for rows that are read often.
bool needs_copy(const SourceTraits& traits, Look look, const Resources& resources);

/// The same volume from a copy of its samples in `folder`: the spool of `resources`, or else the usual one for temporary
/// files. `tell` is called before. Throws WorldError if that folder lacks the room, and if it is in memory, is not one
/// that the user named, and the copy with `besides` would exceed the limit on memory.
std::unique_ptr<VolumeSource> copied(std::unique_ptr<VolumeSource> source, const std::string& folder,
                                     const Resources& resources, std::uint64_t besides,
                                     const TellOfCopy& tell);

/// A view of a source without a copy, from which any rows can be read. It keeps up to `kept` slices. `source` must
/// outlive it.
std::unique_ptr<VolumeSource> view_of_rows(VolumeSource& source, std::int64_t kept);

}  // namespace tagrid
