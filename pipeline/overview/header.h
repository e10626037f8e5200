// The header of an overview.
#pragma once

#include <cstdint>

#include "io/tag/header.h"
#include "io/tag/index.h"

namespace tagrid {

/// The header of an overview of a file. `total` are the statistics of the file's samples.
TagHeader overview_header(const TagHeader& file, std::int64_t factor, const Statistics& total);

/// What a file takes besides the blocks of bricks and the pages of its index, about: header, directory, footer.
double bytes_besides_bricks(const TagHeader& header);

}  // namespace tagrid
