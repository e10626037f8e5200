// A chunk of a data set as the bytes of a .tag file, and back.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "plugins/hdf5/settings.h"

namespace tagrid::hdf5 {

/// The chunk as a .tag file without a stored grid: of the samples, or of their places on a lattice
/// (lattice.h). Throws Error.
///
///   samples  x fastest, in the byte order of the chunk
///
/// REQUIRES: samples.size() == chunk.bytes().
std::vector<std::byte> encode(const Chunk& chunk, const Choice& choice, std::span<const std::byte> samples);

/// Decodes the bytes of a .tag file, whoever made it, to the samples of a chunk, in its byte order. Throws Error
/// if the file is damaged, its samples are not of the chunk's type and size, or they may be off by more than what
/// was chosen.
///
/// REQUIRES: samples.size() == chunk.bytes().
void decode(const Chunk& chunk, const Choice& choice, std::span<const std::byte> file,
            std::span<std::byte> samples);

}  // namespace tagrid::hdf5
