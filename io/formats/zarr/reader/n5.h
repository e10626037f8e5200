// Blocks and scales of N5, which is like Zarr with its axes in the reverse order:
// https://github.com/saalfeldlab/n5
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/formats/zarr/reader/array.h"
#include "io/formats/zarr/reader/image.h"
#include "io/formats/zarr/reader/store.h"

namespace tagrid {

/// Bytes of the header of a block of so many axes, at most.
constexpr std::size_t most_n5_header(std::size_t axes) { return 4 + 4 * axes + 4; }

/// The samples in the file of the block with these numbers, as many as a block of the array has: those beyond the end
/// of the array, which the file may not have, are zeros. Throws BrokenInput if it has fewer than that. Safe for any
/// bytes.
std::vector<std::byte> n5_block(const std::vector<std::byte>& stored, const ZarrArray& array,
                                const std::vector<std::int64_t>& numbers, const std::string& name);

/// Sets the scale and the units of the axes of an image by the attributes of its array and of the group around it:
/// "resolution" and "units", or "pixelResolution", times the "downsamplingFactors" of the array. A "resolution" of an
/// array that has factors may be that of any level, and is not used. Adds remarks and doubts. Throws WorldError,
/// BrokenInput.
void set_n5_scale(const ZarrStore& store, ZarrImage& image);

/// True for an attribute that set_n5_scale() reads.
bool is_n5_scale(const std::string& name);

}  // namespace tagrid
