// Zstandard for the parts of a file other than coded bricks.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "stages/sample/status.h"

namespace tagrid {

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes);

/// Decompresses `bytes` into exactly `size` bytes. Memory grows with the actual output, not with `size`.
Status zstd_decompress(std::span<const std::byte> bytes, std::size_t size, std::vector<std::byte>& out);

}  // namespace tagrid
