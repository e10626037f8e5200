// Codes a brick of samples of 8 or 16 bits, or of such numbers, by a wavelet, for low rates: not each sample has a bound, but their mean
// squared error is small for the bytes. If there is a bound, too, samples beyond it are corrected.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/filter_fit.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/status.h"

namespace tagrid {

/// What the encoder and the decoder of a brick both know.
struct TransformBrick {
  Index3 size;
  std::uint32_t step = 1;      ///< of quantization, in 2^-6 of a sample, 1 .. largest_transform_step
  std::int64_t max_error = 0;  ///< of any sample
  FilterWeights filter{};
  FilterSums* sums = nullptr;  ///< an encoder adds the errors that a filter can mend; nullptr: nowhere
};

/// Appends the code of a brick, x fastest. Returns false and appends nothing if it would be long: for noise that is
/// large compared with the step. `reconstruction`: what decode_transform() will return; may be the samples only if
/// the result is true. The same arguments give the same bytes on every machine.
template <class T>
bool encode_transform(std::span<const T> samples, const TransformBrick& brick, std::span<T> reconstruction,
                      std::vector<std::uint8_t>& out);

/// The inverse. Safe on any bytes; returns an error if they end too soon or are not used up. `samples` may have room
/// for the first slices only.
template <class T>
Status decode_transform(std::span<const std::uint8_t> bytes, const TransformBrick& brick,
                        std::span<T> samples);

/// The peak of the heap, including the bytes that are appended. Noise takes up to 57 events a sample, but the encoder
/// gives up after 8.
std::uint64_t working_bytes_of_encoding_transform(Index3 size);
std::uint64_t working_bytes_of_decoding_transform(Index3 size);

}  // namespace tagrid
