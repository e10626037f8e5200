// One volume of a source that holds several, one after the other along z.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "io/volume/volume_source.h"

namespace tagrid {

/// The key-value pair with the name of one volume of several, or its moment.
inline constexpr std::string_view volume_name_key = "volume_name";

/// The description of volume `number`, from 0 on, of a source of info.volumes: with its name, if it has one.
VolumeInfo info_of_volume(const SourceFacts& several, std::int64_t number);

/// True if `source` asks for all volumes of a file, which then has several that are not too many for a .tag
/// file: otherwise one must be chosen.
bool are_all_wanted(const SourceDescription& source, const Index3& dims, std::int64_t volumes);
/// The description of so many volumes like this one.
void take_all_volumes(VolumeInfo& one, std::int64_t volumes);

/// Volume `number`, from 0 on, of a source of info().volumes. It reads through `several`, which nobody else
/// reads meanwhile. If that is no file, volumes must be read in their order. Facts about files are those of
/// the whole source.
std::unique_ptr<VolumeSource> one_of_volumes(std::shared_ptr<VolumeSource> several, std::int64_t number);
/// The same for a source that outlives the result.
std::unique_ptr<VolumeSource> one_of_volumes(VolumeSource& several, std::int64_t number);

}  // namespace tagrid
