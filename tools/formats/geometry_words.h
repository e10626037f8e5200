// Names by which attributes of any program may say where samples lie.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// True if an attribute or a field of this name may say where samples lie: "voxel_size", "PixelSpacing", "affine". By
/// its words, so it may be wrong either way.
bool looks_like_geometry(std::string_view name);

/// A sentence without a full stop that names what looks like geometry and is not applied. `object` is for messages.
/// REQUIRES: names.
std::string about_unread_geometry(const std::string& object, const std::vector<std::string>& names);

/// A sentence without a full stop about distances whose order no convention states. They are read as x, y, z.
std::string about_assumed_order(const std::string& object, std::string_view attribute);

}  // namespace tagrid
