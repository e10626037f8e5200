// Chunks of a data set with the filter: the numbers that HDF5 keeps for them, and their bytes as a .tag file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tagrid/tagrid.hpp"

namespace tagrid::hdf5 {

/// The number of the filter in HDF5's registry, which keeps 32768 to 65535 for filters that are not
/// registered.
constexpr int filter_id = TAGRID_HDF5_FILTER_ID;

/// What a user chooses.
struct Choice {
  double max_error = 0;  ///< no sample is off by more
  tagrid_effort effort = TAGRID_EFFORT_DEFAULT;
  /// Every chunk is written once, as a whole: then it may be coded without the lattice, which takes fewer
  /// bytes. Otherwise the bound holds however often HDF5 encodes what it decoded.
  bool whole_chunks = false;
  /// No sample changes its side of these; only with whole_chunks.
  std::vector<double> thresholds;
};

/// The samples of a chunk.
struct Chunk {
  tagrid_type type = TAGRID_UINT8;
  bool big_endian = false;
  std::array<std::int64_t, 3> dims = {1, 1, 1};  ///< x, y, z; x fastest
  std::uint64_t fill = 0;                        ///< the bits of the fill value, in the machine's byte order

  std::size_t sample_count() const;
  std::size_t bytes() const { return sample_count() * tagrid_sample_size(type); }
};

/// The numbers (`cd_values`). What a user gives has none to eight of them:
///
///     (none)                   every sample comes back
///     E                        the bound is the whole number E
///     low high                 the bound is a double, by its 32 low and its 32 high bits
///     low high effort          0 default, 1 fast, 2 best
///     low high effort whole    1: chunks are written once, as a whole; 0: they may be written in parts
///     low high effort 1 ...    and one or two thresholds, each a double as two numbers
///
/// What is stored in a file has eleven: low, high, effort, whole, the version of this layout (2, or 3 with thresholds),
/// type + 256 if samples are big endian, the samples of a chunk along x, y and z, and the 32 low and 32 high bits of the
/// fill value. Then come the thresholds. There are no more, because h5py before 3.16 reads at most 16 numbers.
constexpr std::size_t stored_numbers = 11, least_with_thresholds = 4, most_numbers_of_thresholds = 4,
                      most_given = least_with_thresholds + most_numbers_of_thresholds,
                      most_stored = stored_numbers + most_numbers_of_thresholds;

/// What a user chose, or a stored data set has. Throws Error if the numbers say nothing, or the bound is no
/// bound.
Choice choice_of(std::span<const unsigned> numbers);

/// Throws Error if the numbers are not those of a stored data set, or its chunk is larger than HDF5 allows.
Chunk chunk_of(std::span<const unsigned> numbers);

std::vector<unsigned> numbers_of(const Choice& choice, const Chunk& chunk);

/// The chunk as a .tag file without a stored grid: of the samples, or of their places on a lattice
/// (lattice.h). Throws Error.
///
///   samples  x fastest, in the byte order of the chunk
///
/// `memory_for_samples` gives chunk.bytes() bytes, and is called when the file was found to fit.
std::vector<std::byte> encode(const Chunk& chunk, const Choice& choice, std::span<const std::byte> samples);

/// Decodes the bytes of a .tag file, whoever made it, to the samples of a chunk, in its byte order. Throws Error
/// if the file is damaged, its samples are not of the chunk's type and size, or they may be off by more than what
/// was chosen.
///
/// `memory_for_samples` gives chunk.bytes() bytes, and is called when the file was found to fit.
void decode(const Chunk& chunk, const Choice& choice, std::span<const std::byte> file,
            const std::function<std::span<std::byte>()>& memory_for_samples);

}  // namespace tagrid::hdf5
