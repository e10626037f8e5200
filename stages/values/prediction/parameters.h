// What the values of a brick are coded with: how samples are held, and the parameters that the encoder finds
// and stores before the first voxel.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <type_traits>

#include "stages/entropy/adaptive_bit.h"
#include "stages/values/prediction/weights.h"

namespace tagrid {

/// The type in which samples of 8 and 16 bits are held while coding: int16, with sums in 32 bits (see
/// weight_limit).
template <class T>
struct Held {
  using Value = std::int16_t;
  static constexpr std::int32_t offset = std::is_same_v<T, std::uint16_t> ? 32768 : 0;
  static Value from(T sample) { return static_cast<Value>(std::int32_t{sample} - offset); }
  static T to(std::int32_t value) { return static_cast<T>(value + offset); }
};

/// Stored with every brick that is not constant. Values are as held.
struct VoxelParameters {
  std::int32_t low = 0, high = 0;  ///< range of the originals
  std::int32_t reference = 0;      ///< weights apply to differences from this value
  Weights first_slice, others;
};

template <class Coder>
void code_weights(Coder& coder, IntegerModel& model, Weights& weights, int count) {
  const Weights origin = default_weights();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    weights.of_tap[i] = static_cast<std::int32_t>(
        origin.of_tap[i] +
        std::clamp<std::int64_t>(model.code_signed(coder, weights.of_tap[i] - origin.of_tap[i]),
                                 -4 * weight_limit, 4 * weight_limit));
}

/// Codes the parameters. Returns false if the encoder could not have written them.
template <class T, class Coder>
bool code_parameters(Coder& coder, VoxelParameters& parameters) {
  constexpr int bits = 8 * sizeof(T);
  const auto value = [&coder](std::int32_t& v) {
    const auto sample = coder.code_raw(static_cast<std::make_unsigned_t<T>>(Held<T>::to(v)), bits);
    v = Held<T>::from(static_cast<T>(sample));
  };
  value(parameters.low);
  value(parameters.high);
  value(parameters.reference);
  IntegerModel model;
  code_weights(coder, model, parameters.first_slice, slice_taps);
  code_weights(coder, model, parameters.others, all_taps);
  return parameters.low < parameters.high && parameters.low <= parameters.reference &&
         parameters.reference <= parameters.high && parameters.first_slice.magnitude() <= weight_limit &&
         parameters.others.magnitude() <= weight_limit;
}

/// Finds the parameters of a brick whose samples are from `low` to `high`.
template <class T>
VoxelParameters fit_parameters(std::span<const T> samples, Index3 size, std::int64_t max_error, T low,
                               T high) {
  VoxelParameters parameters;
  std::int64_t total = 0;
  for (const T sample : samples) total += sample;
  const auto mean = static_cast<T>(total / static_cast<std::int64_t>(samples.size()));
  parameters.low = Held<T>::from(low);
  parameters.high = Held<T>::from(high);
  parameters.reference = Held<T>::from(mean);
  const double error = static_cast<double>(std::min<std::int64_t>(max_error, 65535));
  const double noise = error * (error + 1) / 3;
  const std::int64_t magnitude = std::max(std::int64_t{high} - mean, std::int64_t{mean} - low);
  parameters.first_slice = fit_weights(samples, size, slice_taps, std::int64_t{mean}, magnitude, noise);
  parameters.others = size.z > 1 ? fit_weights(samples, size, all_taps, std::int64_t{mean}, magnitude, noise)
                                 : default_weights();
  return parameters;
}

}  // namespace tagrid
