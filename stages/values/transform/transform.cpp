#include "stages/values/transform/transform.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "stages/bound/bounds.h"
#include "stages/entropy/rans_coder.h"
#include "stages/sample/vector_code.h"
#include "stages/values/transform/coefficients.h"
#include "stages/values/transform/filter.h"
#include "stages/values/transform/lifting.h"
#include "stages/values/transform/shape.h"

namespace tagrid {

/// Magnitudes in 2^-4 of a step, those that become 0 as 0; and the squares of the others, in 2^-6, added up.
TAGRID_VECTOR_CODE std::int32_t magnitudes_of_row(const std::int32_t* c, std::size_t n, float per_step,
                                                  std::int32_t* magnitudes) {
  std::int32_t lost = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const float a = std::min(std::fabs(static_cast<float>(c[i]) * per_step), 255.0f);
    const bool kept = a >= 0.6f;
    magnitudes[i] = kept ? static_cast<std::int32_t>(a * 16) : 0;
    lost += static_cast<std::int32_t>(kept ? 5.0f : a * a * 64);
  }
  return lost;
}

namespace {

constexpr std::uint64_t most_events_per_sample = 8;

std::uint64_t count_of(Index3 size) { return static_cast<std::uint64_t>(size.x * size.y * size.z); }

/// The bits of four neighbouring coefficients, by the sum of their magnitudes in steps, as costs in 2^-6 of the square
/// of a step. As if magnitudes had a geometric distribution with this mean.
const std::array<std::int32_t, 1024> costs_of_four = [] {
  std::array<std::int32_t, 1024> costs{};
  for (std::size_t i = 1; i < costs.size(); ++i) {
    // floor(i / 4 + 1) would be exact; a polygon through powers of two is near enough to the logarithm.
    const auto log2 = [](double v) {
      int whole = 0;
      for (; v >= 2; v /= 2) ++whole;
      for (; v < 1; v *= 2) --whole;
      return whole + (v - 1) * (1.34 - 0.34 * (v - 1));
    };
    const double mean = static_cast<double>(i) / 4;
    const double bits = (1 + mean) * log2(1 + mean) - mean * log2(mean) + mean / (1 + mean);
    costs[i] = static_cast<std::int32_t>((4 * bits + 2) * 6.4);
  }
  return costs;
}();

/// What is lost and what the bits are worth, in 2^-6 of the square of a step. Only says which split is better.
std::int64_t cost_of(std::span<const std::int32_t> coefficients, const TransformShape& shape) {
  std::int64_t sum = 0;
  std::array<std::int32_t, longest_line + 4> magnitudes;
  for (const Band& band : std::span(shape.bands).subspan(1)) {
    const auto n = static_cast<std::size_t>(band.size.x);
    for (std::int64_t z = band.low.z; z < band.low.z + band.size.z; ++z)
      for (std::int64_t y = band.low.y; y < band.low.y + band.size.y; ++y) {
        sum += magnitudes_of_row(coefficients.data() + (z * shape.size.y + y) * shape.size.x + band.low.x, n,
                                 256.0f / static_cast<float>(band.steps[0]), magnitudes.data());
        std::fill_n(magnitudes.data() + n, 4, 0);
        for (std::size_t i = 0; i < n; i += 4) {
          const std::int32_t four = magnitudes[i] + magnitudes[i + 1] + magnitudes[i + 2] + magnitudes[i + 3];
          if (four > 0) sum += costs_of_four[static_cast<std::size_t>(std::min(four >> 4, 1023))];
        }
      }
  }
  return sum;
}

/// The mean of the samples. Coefficients are of differences to it: high bands of a constant are not quite 0.
template <class T>
std::int32_t center_of(std::span<const T> samples) {
  const auto sum = std::accumulate(samples.begin(), samples.end(), std::int64_t{0});
  return static_cast<std::int32_t>(sum / static_cast<std::int64_t>(samples.size()));
}

template <class T>
void load(std::span<const T> samples, std::int32_t center, std::span<std::int32_t> coefficients) {
  for (std::size_t i = 0; i < samples.size(); ++i)
    coefficients[i] = (samples[i] - center) * (1 << fraction_bits(sizeof(T)));
}

template <class T>
void store(std::span<const std::int32_t> coefficients, std::int32_t center, std::span<T> samples) {
  constexpr int bits = fraction_bits(sizeof(T));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::int32_t rounded = (coefficients[i] >> bits) + (coefficients[i] >> (bits - 1) & 1) + center;
    samples[i] = static_cast<T>(
        std::clamp<std::int32_t>(rounded, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
  }
}

/// The best split, and the coefficients with it.
template <class T>
TransformShape split_best(std::span<const T> samples, std::int32_t center, const TransformBrick& brick,
                          std::vector<std::int32_t>& coefficients) {
  const auto shape_of = [&](Split split) {
    return transform_shape(brick.size, split, brick.step, fraction_bits(sizeof(T)));
  };
  TransformShape best = shape_of(Split::dyadic);
  load(samples, center, std::span(coefficients));
  transform_forward(coefficients, best);
  if (best.levels(2) == 0) return best;
  std::vector<std::int32_t> others(coefficients.size());
  load(samples, center, std::span(others));
  std::int64_t least = cost_of(coefficients, best);
  int levels = 0;
  for (const Split split : {Split::z1, Split::z2, Split::z4}) {
    TransformShape shape = shape_of(split);
    if (levels == 0) split_slices(others, shape);
    if (shape.levels(2) == levels) break;
    for (; levels < shape.levels(2); ++levels) split_along_z(others, shape, levels);
    if (const std::int64_t cost = cost_of(others, shape); cost < least) {
      least = cost;
      best = std::move(shape);
    }
  }
  if (best.split == Split::dyadic) return best;
  while (levels > best.levels(2)) join_along_z(others, shape_of(Split::z4), --levels);
  coefficients.swap(others);
  return best;
}

template <class T>
std::uint64_t squared_error(std::span<const T> samples, std::span<const T> decoded) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::int64_t error = std::int64_t{samples[i]} - decoded[i];
    sum += static_cast<std::uint64_t>(error * error);
  }
  return sum;
}

/// Filters what is stored in `decoded` already, unless that loses more. `values` are changed. Returns whether it did.
template <class T>
bool filter_if_better(std::span<const T> samples, std::int32_t center, const TransformBrick& brick,
                      std::span<std::int32_t> values, std::span<T> decoded) {
  const std::uint64_t before = squared_error<T>(samples, decoded);
  filter_brick(values, brick.size, brick.step, fraction_bits(sizeof(T)), brick.filter);
  std::vector<T> filtered(samples.size());
  store<T>(values, center, filtered);
  if (squared_error<T>(samples, filtered) >= before) return false;
  std::copy(filtered.begin(), filtered.end(), decoded.begin());
  return true;
}

template <class T>
void add_errors(std::span<const T> samples, std::int32_t center, const TransformBrick& brick,
                std::span<const std::int32_t> values, FilterSums& sums) {
  std::vector<std::int32_t> lacking(samples.size());
  load(samples, center, std::span(lacking));
  for (std::size_t i = 0; i < lacking.size(); ++i) lacking[i] -= values[i];
  add_to_sums(values, lacking, brick.size, brick.step, fraction_bits(sizeof(T)), sums);
}

/// Corrects samples beyond the bound E by multiples of 2E + 1: their number, and for each the samples since the one
/// before, and the multiple. Returns false if a decoder finds a place that does not exist.
template <class T, class Coder>
bool code_corrections(Coder& coder, std::span<const T> original, std::int64_t max_error,
                      std::span<T> samples) {
  const Quantizer quantizer(std::clamp<std::int64_t>(max_error, 0, 65535));
  IntegerModel number, gap, multiple;
  std::uint64_t left = 0;
  const auto needed = [&](std::size_t i) {
    return quantizer(std::int32_t{original[i]} - std::int32_t{samples[i]});
  };
  if constexpr (Coder::encoding)
    for (std::size_t i = 0; i < samples.size(); ++i) left += needed(i) != 0;
  left = number.code(coder, left);
  for (std::size_t at = 0; left > 0; --left, ++at) {
    std::size_t skipped = 0;
    std::int64_t q = 0;
    if constexpr (Coder::encoding) {
      while (needed(at + skipped) == 0) ++skipped;
      q = needed(at + skipped);
    }
    const std::uint64_t distance = gap.code(coder, skipped);
    if (distance >= samples.size() - at) return false;
    at += distance;
    // Not 0, so that signs are those of |q| - 1.
    q = multiple.code_signed(coder, q > 0 ? q - 1 : q);
    q += q >= 0;
    const std::int64_t corrected = samples[at] + std::clamp<std::int64_t>(q, -65536, 65536) * quantizer.step;
    samples[at] = static_cast<T>(
        std::clamp<std::int64_t>(corrected, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
    if (coder.exhausted()) return false;
  }
  return true;
}

}  // namespace

template <class T>
bool encode_transform(std::span<const T> samples, const TransformBrick& brick, std::span<T> reconstruction,
                      std::vector<std::uint8_t>& out) {
  std::vector<std::int32_t> coefficients(samples.size());
  const std::int32_t center = center_of(samples);
  const TransformShape shape = split_best(samples, center, brick, coefficients);
  LimitedEncoder coder(out, most_events_per_sample * count_of(brick.size) + 4096);
  coder.code_raw(static_cast<std::uint32_t>(shape.split), 2);
  coder.code_raw(static_cast<std::uint32_t>(center - std::numeric_limits<T>::min()), 8 * sizeof(T));
  {
    const auto model = std::make_unique<CoefficientModel>();
    if (!code_coefficients(coder, *model, shape, coefficients)) return false;
  }
  transform_back(coefficients, shape);
  store<T>(coefficients, center, reconstruction);
  if (brick.sums != nullptr) add_errors(samples, center, brick, coefficients, *brick.sums);
  if (is_filter(brick.filter))
    coder.code_raw(filter_if_better(samples, center, brick, std::span(coefficients), reconstruction), 1);
  if (!code_corrections(coder, samples, brick.max_error, reconstruction)) return false;
  coder.finish();
  return true;
}

template <class T>
Status decode_transform(std::span<const std::uint8_t> bytes, const TransformBrick& brick,
                        std::span<T> samples) {
  RansDecoder coder(bytes);
  const auto split = static_cast<Split>(coder.code_raw(0, 2));
  const std::int32_t center =
      std::numeric_limits<T>::min() + static_cast<std::int32_t>(coder.code_raw(0, 8 * sizeof(T)));
  const TransformShape shape = transform_shape(brick.size, split, brick.step, fraction_bits(sizeof(T)));
  std::vector<std::int32_t> coefficients(count_of(brick.size));
  {
    const auto model = std::make_unique<CoefficientModel>();
    if (!code_coefficients(coder, *model, shape, coefficients)) return Status::broken("values end too soon");
  }
  transform_back(coefficients, shape);
  if (is_filter(brick.filter) && coder.code_raw(0, 1) != 0)
    filter_brick(coefficients, brick.size, brick.step, fraction_bits(sizeof(T)), brick.filter);
  const bool whole = samples.size() == coefficients.size();
  std::vector<T> all(whole ? 0 : coefficients.size());
  const std::span<T> corrected = whole ? samples : std::span<T>(all);
  store<T>(coefficients, center, corrected);
  if (!code_corrections<T>(coder, {}, brick.max_error, corrected))
    return Status::broken("values have a correction where no sample is, or end too soon");
  if (!coder.finished()) return Status::broken("values are followed by other bytes, or end too soon");
  if (!whole) std::copy_n(all.begin(), samples.size(), samples.begin());
  return {};
}

std::uint64_t working_bytes_of_encoding_transform(Index3 size) {
  const std::uint64_t samples = count_of(size);
  // A row may exceed the limit.
  const std::uint64_t events =
      most_events_per_sample * samples + 4096 + 72 * static_cast<std::uint64_t>(size.x);
  return samples * sizeof(std::int32_t) + sizeof(CoefficientModel) +
         std::max(samples * sizeof(std::int32_t),
                  RansEncoder::working_bytes(events) +
                      std::max(working_bytes_of_coefficients(size),
                               working_bytes_of_filter(size) + samples * sizeof(std::int32_t)));
}

std::uint64_t working_bytes_of_decoding_transform(Index3 size) {
  const std::uint64_t samples = count_of(size);
  return samples * (sizeof(std::int32_t) + sizeof(std::uint16_t)) + sizeof(CoefficientModel) +
         std::max(working_bytes_of_coefficients(size), working_bytes_of_filter(size));
}

#define TAGRID_INSTANTIATE(T)                                                             \
  template bool encode_transform(std::span<const T>, const TransformBrick&, std::span<T>, \
                                 std::vector<std::uint8_t>&);                             \
  template Status decode_transform(std::span<const std::uint8_t>, const TransformBrick&, std::span<T>);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
