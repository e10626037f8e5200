// The numbers of TIFF's tags in words.
#pragma once

#include <tiffio.h>

#include <cstdint>
#include <string>

#include "tools/formats/tiff/tiff_page.h"

namespace tagrid {

/// Of a scheme that is not read.
std::string name_of_compression(std::uint16_t scheme);
/// What pixels are if they are not single numbers.
std::string name_of_meaning(std::uint16_t photometric);
/// How the samples of the current page are stored, for users.
std::string name_of_storage(TIFF* tiff, const TiffPage& page);

bool may_have_predictor(std::uint16_t scheme);
/// Whether decoding gives the numbers that were stored.
bool is_lossless(std::uint16_t scheme);

}  // namespace tagrid
