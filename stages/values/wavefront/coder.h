// Codes the values of a brick in thirty-two lanes, with the vector instructions that the machine has.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/values/prediction/parameters.h"
#include "stages/values/wavefront/buffers.h"

namespace tagrid {

/// What both directions know of a brick.
struct WaveBrick {
  Index3 size;
  VoxelParameters parameters;
  /// Bounds of inactive and of active points.
  std::array<std::int64_t, 2> errors;
  /// Which points are active, if the bounds differ; else null. `origin` is the first voxel of the brick.
  const LatticeBits* activity = nullptr;
  Index3 origin;
  /// One distribution for a symbol instead of two: faster, for more bytes.
  bool one_distribution = false;
};

/// Rows of samples, as numbers of 16 bits. `first`: the index of the first sample of a row.
struct RowReader {
  const void* samples;
  void (*read)(const void* samples, std::int64_t first, std::int64_t count, std::int16_t* to);
};
struct RowWriter {
  void* samples;
  void (*write)(void* samples, std::int64_t first, std::int64_t count, const std::int16_t* from);
  std::int64_t slices;  ///< number of slices to write, from the first one on
};

/// A set of rows, by half and group: one bit a lane.
using RowSet = std::array<std::vector<std::uint16_t>, 2>;

/// The values of a brick as symbols. What is missing is to push these into the states, from the last to the
/// first.
struct WaveSymbols {
  explicit WaveSymbols(const WaveBrick& brick);

  WaveBuffers buffers;             ///< intervals of the symbols, and rows without a residual
  LowBitsOfSteps low_bits;         ///< of residuals with a symbol
  std::vector<std::uint8_t> bits;  ///< of residuals without a symbol
};

/// Predicts and quantizes the voxels of a brick; then its reconstruction is complete.
WaveSymbols encode_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction);

struct WaveCode {
  bool single = false;               ///< one state for all lanes
  std::vector<std::uint16_t> words;  ///< states, then what they take in
  std::size_t carried = 0;           ///< bytes: two for each state, or none
};

/// Pushes the symbols into states. A state begins with any 16 bits: the first bytes of `to_carry`, if they
/// are enough for all states.
WaveCode push_symbols(WaveSymbols& symbols, std::span<const std::uint8_t> to_carry);

/// What a decoder knows of the code, beside the brick.
struct WaveBytes {
  RowSet quiet;
  bool single = false;
  bool carries = false;                 ///< bytes
  std::span<const std::uint8_t> bits;   ///< of residuals without a symbol
  std::span<const std::uint8_t> words;  ///< states, then what they take in
};

/// Returns false if the code is not one of these two. The bytes that it carries are appended to `carried`.
/// Only the requested slices are decoded: if these are not all, the rest of the code is not checked, and
/// nothing is appended.
bool decode_wave(const WaveBrick& brick, const WaveBytes& code, RowWriter samples,
                 std::vector<std::uint8_t>& carried);

}  // namespace tagrid
