// The parameters of a brick's voxels: found by the encoder, stored before the first voxel.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "stages/entropy/integer_model.h"
#include "stages/voxels/prediction.h"
#include "stages/voxels/window.h"

namespace tagrid {

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
  return parameters.low < parameters.high && parameters.first_slice.magnitude() <= weight_limit &&
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
  parameters.first_slice = fit_weights(samples, size, slice_taps, std::int64_t{mean}, noise);
  parameters.others =
      size.z > 1 ? fit_weights(samples, size, all_taps, std::int64_t{mean}, noise) : default_weights();
  return parameters;
}

}  // namespace tagrid
