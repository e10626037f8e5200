// How the numbers of one brick of wide samples are made and coded: what its stream begins with.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/volume/numbers.h"
#include "stages/voxels/prediction.h"
#include "stages/wide/codec.h"

namespace tagrid {

struct WideParameters {
  bool fixed = false;      ///< floats: numbers are multiples of 2^exponent; else keys
  int exponent = 0;        ///< lowest_exponent .. highest_exponent
  bool escapes = false;    ///< floats: some voxel may escape
  bool corrected = false;  ///< floats: active voxels are followed by what is missing to their exact key
  std::array<std::int64_t, 2>
      error{};                     ///< of a number: of other voxels, of active ones; at most largest_fixed
  std::int64_t low = 0, high = 0;  ///< of the numbers
  std::int64_t reference = 0;      ///< low .. high
  Weights first_slice, others;
};

/// The numbers of the samples of a brick.
struct WideNumbers {
  std::vector<std::int64_t> numbers;  ///< an escaped sample has that of the one before
  std::vector<std::uint8_t> escaped;  ///< 1 where a sample has no number
};

/// Chooses the form of the numbers, makes them and fits the weights.
template <class T>
WideParameters choose_parameters(std::span<const T> samples, Index3 size, const WideBounds& bounds,
                                 WideNumbers& numbers);

/// Codes the parameters, in both directions. False where they could not have been written by the encoder.
template <class T, class Coder>
bool code_wide_parameters(Coder& coder, bool two_bounds, WideParameters& parameters);

}  // namespace tagrid
