// Volumes whose slices lie in several files, or at several places of one.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "io/volume/sample_places.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// The volume of `facts`, whose slices lie in its files as the runs say, from front to back. The traits
/// follow from that: any rows can be read. Throws WorldError if a file cannot be opened, or is not a regular
/// one; BrokenInput if it ends before its slices do. REQUIRES: only integers have stored bits; the runs have
/// info.dims.z slices, and the numbers of their files exist.
std::unique_ptr<VolumeSource> placed_samples(SourceFacts facts, std::vector<SliceRun> runs);

/// A volume of placed_samples() once more, by its facts; the files are shared and not looked at. REQUIRES:
/// facts.opened.
std::unique_ptr<VolumeSource> placed_samples_again(const SourceFacts& facts);

/// Opens part i of a volume: a source of some of its slices.
using OpenPart = std::function<std::unique_ptr<VolumeSource>(std::int64_t i)>;

/// The volume of `facts`, which consists of `parts` with equally many slices, from front to back. `files` are
/// those of all parts; `plain_form`, if given, describes the files besides those of parts. Traits follow from
/// the parts, whose memory is added to that of `facts`. Opens all parts, so that what is wrong with one is
/// found at once, and from then on one at a time. REQUIRES: parts > 0; dims.z is a multiple of it; parts can
/// be read again.
std::unique_ptr<VolumeSource> joined(SourceFacts facts, std::int64_t parts, OpenPart open);

}  // namespace tagrid
