// A TIFF file as it would be if the samples of some of its pages lay plainly in it, one after the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/programs/reader_conversation.h"
#include "tools/formats/tiff/tiff_file.h"

namespace tagrid {

/// The plain form of the file at `path`, which is number `number` among those of its volume; `pages` are those of its
/// pages that are slices, in the order of the volume. Their samples lie one after the other from `samples_at` on, and all
/// directories come after them. Pages keep all tags but those that say how samples are stored: they become uncompressed, in
/// one strip each, and packed samples get 8 or 16 bits. Pages that are not slices of the volume keep their strips as they are; but if they are compressed and of full size, there is no
/// plain form.
/// The file is BigTIFF if it was, or if it would be too large otherwise. Without a plain form, `why_not` is given. Throws WorldError.
ReaderPlainFile plain_tiff_file(const std::string& path, std::size_t number,
                                const std::vector<const TiffPage*>& pages, std::uint64_t& samples_at);

}  // namespace tagrid
