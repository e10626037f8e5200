// One volume of a source that holds several, one after the other along z.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "io/volume/volume_source.h"

namespace tagrid {

/// The key-value pair with the name of one volume of several, or its moment.
inline constexpr std::string_view volume_name_key = "volume_name";

/// The description of volume `number`, from 0 on, of a source of info.volumes: with its name, if it has one.
VolumeInfo info_of_volume(const SourceFacts& several, std::int64_t number);

/// The number, from 0 on, of the volume that `source` asks for in the file `name` of `volumes` like `one`, which
/// source.series numbers from 1 on; without it, of the only one. Nothing if `source` asks for all, and they are
/// not too many for a .tag file. Throws UsageError if one of several must be chosen, or if there is no such one.
std::optional<std::int64_t> wanted_volume(const SourceDescription& source, const std::string& name,
                                          const VolumeInfo& one, std::int64_t volumes);
/// The description of so many volumes like this one.
void take_all_volumes(VolumeInfo& one, std::int64_t volumes);

/// Volume `number`, from 0 on, of a source of info().volumes. It reads through `several`, which nobody else
/// reads meanwhile. If that is no file, volumes must be read in their order. Facts about files are those of
/// the whole source.
std::unique_ptr<VolumeSource> one_of_volumes(std::shared_ptr<VolumeSource> several, std::int64_t number);
/// The same for a source that outlives the result.
std::unique_ptr<VolumeSource> one_of_volumes(VolumeSource& several, std::int64_t number);

}  // namespace tagrid
