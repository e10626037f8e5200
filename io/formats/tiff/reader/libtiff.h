// libtiff's messages, which it passes to handlers for the entire process, and its numbers in words.
#pragma once

#include <tiffio.h>

#include <cstdint>
#include <string>

#include "io/formats/tiff/reader/tiff_page.h"

namespace tagrid {

/// Of the last call.
extern std::string last_reason, last_warning;
/// What it said of the tags of the last directory that it could not use.
extern TiffRemarks of_tags;

/// From now on, libtiff tells these.
void listen_to_libtiff();

/// The number of a tag, or its default; `otherwise` if it has none. REQUIRES: T is the type in which libtiff
/// gives it.
template <class T>
T value_of(TIFF* tiff, std::uint32_t tag, T otherwise) {
  T value = otherwise;
  return TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : otherwise;
}

/// Of a scheme of compression.
std::string name_of_compression(std::uint16_t scheme);
/// What pixels are if they are not single numbers.
std::string name_of_meaning(std::uint16_t photometric);
/// How the samples of the current page are stored, for users.
std::string name_of_storage(TIFF* tiff, const TiffPage& page);

bool may_have_predictor(std::uint16_t scheme);
/// Whether decoding gives the numbers that were stored.
bool is_lossless(std::uint16_t scheme);

}  // namespace tagrid
