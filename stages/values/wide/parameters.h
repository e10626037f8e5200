// How the numbers of one brick of wide samples are made and coded. These parameters begin its stream.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/numbers.h"
#include "stages/values/prediction/weights.h"
#include "stages/values/wide/codec.h"

namespace tagrid {

struct WideParameters {
  bool fixed = false;      ///< floats: numbers are multiples of 2^exponent; else keys
  int exponent = 0;        ///< lowest_exponent .. highest_exponent
  bool escapes = false;    ///< floats: some voxel may escape
  bool corrected = false;  ///< floats: active voxels are followed by the difference to their exact key
  std::array<std::int64_t, 2>
      error{};                     ///< of a number, for inactive and for active voxels; at most largest_fixed
  std::int64_t low = 0, high = 0;  ///< range of the numbers
  std::int64_t reference = 0;      ///< low .. high
  Weights first_slice, others;
};

/// The numbers of the samples of a brick.
struct WideNumbers {
  std::vector<std::int64_t> numbers;  ///< an escaped sample has the number of the one before
  std::vector<std::uint8_t> escaped;  ///< 1 where a sample has no number
};

/// Chooses the form of the numbers, computes them, and fits the weights.
template <class T>
WideParameters choose_parameters(std::span<const T> samples, Index3 size, const WideBounds& bounds,
                                 WideNumbers& numbers);

/// Codes the parameters in both directions. Returns false if the encoder could not have written them.
template <class T, class Coder>
bool code_wide_parameters(Coder& coder, bool two_bounds, WideParameters& parameters);

}  // namespace tagrid
