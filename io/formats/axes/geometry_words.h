// Recognizes names of attributes that may describe a geometry, of any program.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// True if an attribute or a field with this name may describe a geometry: "voxel_size",
/// "PixelSpacing", "affine". Only the words of the name decide, so both answers may be wrong.
bool looks_like_geometry(std::string_view name);

/// A sentence without a full stop that names what looks like geometry but is not used. `object` is
/// for messages. REQUIRES: `names` is not empty.
std::string about_unread_geometry(const std::string& object, const std::vector<std::string>& names);

/// A sentence without a full stop about distances whose order is not stated. They are read as x, y,
/// z.
std::string about_assumed_order(const std::string& object, std::string_view attribute);

}  // namespace tagrid
