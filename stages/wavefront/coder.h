// Codes the values of a brick in thirty-two lanes, with the vector instructions that the machine has.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/prediction/parameters.h"
#include "stages/volume/carrying.h"

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
  std::int64_t slices;  ///< rows of so many slices, the first ones, are wanted
};

/// A set of rows, by half and group: one bit a lane.
using RowSet = std::array<std::vector<std::uint16_t>, 2>;

struct WaveCode {
  RowSet quiet;                      ///< rows without a residual
  std::vector<std::uint8_t> bits;    ///< of residuals without a symbol
  bool single = false;               ///< one state for all lanes
  std::vector<std::uint16_t> words;  ///< states, then what they take in
  std::size_t carried = 0;           ///< bytes: two for each state, or none
};

/// `to_carry` may be empty.
void encode_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction,
                 const BytesToCarry& to_carry, WaveCode& code);

/// Returns false if the code is not one of encode_wave(). `carried`: null if it carries nothing. Decoding ends with the slices
/// that are wanted: if these are not all, the rest of the code is not looked at, and nothing is appended to `carried`.
bool decode_wave(const WaveBrick& brick, const RowSet& quiet, bool single, std::span<const std::uint8_t> bits,
                 std::span<const std::uint8_t> words, RowWriter samples, std::vector<std::uint8_t>* carried);

}  // namespace tagrid
