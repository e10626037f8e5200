// The files of metadata of a store.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/zarr/reader/store.h"
#include "io/programs/answers.h"

namespace tagrid {

/// The object in the file with this key, if there is one. NaN, Infinity and -Infinity, which Python writes and JSON does
/// not have, become the texts that Zarr 3 has for them. Throws BrokenInput if it is not JSON, or no object.
std::optional<Json> json_at(const ZarrStore& store, const std::string& key);

/// For messages.
std::string shown(const Json& json);

/// The text at a member, or "".
std::string text_at(const Json& object, const char* name);

/// The number in eight base64-encoded bytes, little endian, as xarray writes fill values of floats;
/// nothing if the text is not such a number.
std::optional<double> number_of_base64(const std::string& text);

}  // namespace tagrid
