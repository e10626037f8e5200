#include "stages/values/wide/codec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/voxels/constant_brick.h"

namespace tagrid {
namespace {

constexpr std::int64_t widest = 65535;

/// Up to here, all integers are floats of type T.
template <class T>
constexpr double most_exact = static_cast<double>(std::int64_t{1} << std::numeric_limits<T>::digits);

/// Lowest and highest of the samples. Nothing if one of them is not finite, or if it is -0 and has to come
/// back so.
template <class T>
std::optional<std::array<double, 2>> range_of(std::span<const T> samples, bool exactly) {
  T low = samples[0], high = samples[0];
  // Counted as bits, so that the loop can use vectors.
  BitsOf<T> infinite = 0, negative_zero = 0;
  constexpr BitsOf<T> sign = BitsOf<T>{1} << (8 * sizeof(T) - 1);
  for (const T v : samples) {
    low = v < low ? v : low;
    high = v > high ? v : high;
    infinite |= static_cast<BitsOf<T>>((bits_of(v) & ~sign) >= bits_of(std::numeric_limits<T>::infinity()));
    negative_zero |= static_cast<BitsOf<T>>(bits_of(v) == sign);
  }
  if (infinite != 0 || (exactly && negative_zero != 0)) return {};
  return std::array{static_cast<double>(low), static_cast<double>(high)};
}

template <class T>
bool are_whole(std::span<const T> samples) {
  bool all = true;
  for (const T v : samples) all &= std::trunc(v) == v;
  return all;
}

/// The exponent of a unit of which all samples are multiples, if such numbers are narrow, and are samples
/// themselves.
template <class T>
std::optional<int> common_unit(std::span<const T> samples, const std::array<double, 2>& range) {
  const double span = range[1] - range[0], largest = std::max(std::fabs(range[0]), std::fabs(range[1]));
  const auto fits = [&](int exponent) {
    if (exponent < std::max(lowest_exponent,
                            std::numeric_limits<T>::min_exponent - std::numeric_limits<T>::digits) ||
        exponent > highest_exponent)
      return false;
    const double per_unit = power_of_two(-exponent);
    return span * per_unit <= static_cast<double>(widest) &&
           largest * per_unit <= std::min(most_exact<T>, static_cast<double>(largest_fixed));
  };
  if (fits(0) && are_whole(samples)) return 0;
  int lowest = highest_exponent;
  for (const T v : samples) {
    if (v == 0) continue;
    lowest = std::min(lowest, lowest_digit(v));
    if (!fits(lowest)) return {};
  }
  return lowest;
}

std::int64_t limited(double error) {
  return static_cast<std::int64_t>(std::clamp(error, 0.0, static_cast<double>(widest)));
}

template <class T>
std::optional<NarrowForm> narrow_floats(std::span<const T> samples, const WideBounds& bounds,
                                        double transform_step) {
  const bool two = bounds.surface_error >= 0, transformed = transform_step > 0;
  double tight = two ? std::min(bounds.max_error, bounds.surface_error) : bounds.max_error;
  if (transformed) tight = std::min(tight, transform_step / 2);
  const auto range = range_of(samples, tight <= 0);
  if (!range) return {};
  NarrowForm form;
  const auto common = common_unit(samples, *range);
  // A step below that of numbers would have no use.
  if (common && tight >= (transformed ? power_of_two(*common) / 2 : 0)) {
    form.exponent = *common;
    const double per_unit = power_of_two(-*common);
    form.low = static_cast<std::int64_t>((*range)[0] * per_unit);
    form.errors = {limited(std::floor(bounds.max_error * per_unit)),
                   limited(std::floor((two ? bounds.surface_error : bounds.max_error) * per_unit))};
    return form;
  }
  // Otherwise numbers are rounded, which takes half a unit of the bound: at most a hundredth. Of the squared error
  // of a transform, it is at most about as much.
  const double least_units = transformed ? 8 : 64;
  const double span = (*range)[1] - (*range)[0],
               largest = std::max(std::fabs((*range)[0]), std::fabs((*range)[1]));
  if (!(tight > 0) || !std::isfinite(span) || span == 0) return {};
  const int exponent =
      std::max({std::ilogb(span) - 15, std::ilogb(largest) - std::min(std::numeric_limits<T>::digits - 2, 45),
                std::numeric_limits<T>::min_exponent - std::numeric_limits<T>::digits});
  if (exponent < lowest_exponent || exponent > highest_exponent) return {};
  const double per_unit = power_of_two(-exponent);
  if (tight * per_unit < least_units) return {};
  form.exponent = exponent;
  const double low = std::floor((*range)[0] * per_unit + 0.5),
               high = std::floor((*range)[1] * per_unit + 0.5);
  // Rounded up, the largest floats are infinite.
  const double unit = power_of_two(exponent), most = static_cast<double>(std::numeric_limits<T>::max());
  if (high - low > static_cast<double>(widest) || -low * unit > most || high * unit > most) return {};
  form.low = static_cast<std::int64_t>(low);
  // Half a unit, and what the sum above may have been rounded by.
  constexpr double rounding = 0.5 + 0x1p-20;
  form.errors = {limited(std::floor(bounds.max_error * per_unit - rounding)),
                 limited(std::floor((two ? bounds.surface_error : bounds.max_error) * per_unit - rounding))};
  return form;
}

std::array<std::int64_t, 2> integer_errors(const WideBounds& bounds) {
  return {limited(bounds.max_error),
          limited(bounds.surface_error >= 0 ? bounds.surface_error : bounds.max_error)};
}

template <class T>
std::optional<NarrowForm> narrow_integers(std::span<const T> samples, const WideBounds& bounds) {
  T low = samples[0], high = samples[0];
  for (const T v : samples) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (std::int64_t{high} - std::int64_t{low} > widest) return {};
  NarrowForm form;
  form.low = low;
  form.errors = integer_errors(bounds);
  return form;
}

/// The step in units of the numbers, as an integer coder takes it.
double step_of_numbers(const NarrowForm& form, double transform_step) {
  if (!(transform_step > 0)) return 0;
  const double steps = std::floor(transform_step * power_of_two(-form.exponent) / least_transform_step);
  return std::clamp(steps, 1.0, double{largest_transform_step}) * least_transform_step;
}

// The brick of the numbers.
VoxelBrick brick_of_numbers(const NarrowForm& form, const WideBrick& brick) {
  return {brick.owned,
          brick.activity,
          {form.errors[0], brick.bounds.surface_error >= 0 ? form.errors[1] : -1},
          brick.effort,
          step_of_numbers(form, brick.transform_step)};
}

template <class T>
T sample_of(const NarrowForm& form, double unit, std::uint16_t number) {
  const std::int64_t n = form.low + number;
  if constexpr (std::is_floating_point_v<T>)
    return from_fixed_point<T>(n, unit);
  else  // Only a broken stream has numbers beyond the type.
    return static_cast<T>(std::min<std::int64_t>(n, std::numeric_limits<T>::max()));
}

std::uint64_t take(std::span<const std::uint8_t>& bytes, std::size_t count) {
  const std::uint64_t number = number_in(bytes.first(count));
  bytes = bytes.subspan(count);
  return number;
}

/// Floats: the exponent and both errors, two bytes each. All types: the lowest number.
template <class T>
constexpr std::size_t head_bytes = 8 + (std::is_floating_point_v<T> ? 6 : 0);

/// False if no encoder writes this.
template <class T>
bool is_possible(const NarrowForm& form) {
  if constexpr (std::is_floating_point_v<T>)
    return form.exponent >= lowest_exponent && form.exponent <= highest_exponent &&
           form.low >= -largest_fixed && form.low <= largest_fixed;
  return form.low >= std::numeric_limits<T>::min() && form.low <= std::numeric_limits<T>::max();
}

}  // namespace

template <class T>
std::optional<NarrowForm> narrow_form(std::span<const T> samples, const WideBounds& bounds,
                                      double transform_step) {
  if constexpr (std::is_floating_point_v<T>)
    return narrow_floats(samples, bounds, transform_step);
  else
    return narrow_integers(samples, bounds);
}

template <class T>
PendingWide encode_narrow(std::span<const T> samples, const NarrowForm& form, const WideBrick& brick,
                          std::span<T> reconstruction, std::vector<std::uint8_t>& out) {
  append_bytes(static_cast<std::uint64_t>(form.low), 8, out);
  if constexpr (std::is_floating_point_v<T>) {
    append_bytes(static_cast<std::uint64_t>(form.exponent), 2, out);
    for (const std::int64_t error : form.errors) append_bytes(static_cast<std::uint64_t>(error), 2, out);
  }
  std::vector<std::uint16_t> numbers(samples.size());
  if constexpr (std::is_floating_point_v<T>) {
    const double per_unit = power_of_two(-form.exponent), low = static_cast<double>(form.low);
    for (std::size_t i = 0; i < samples.size(); ++i)
      numbers[i] = static_cast<std::uint16_t>(
          static_cast<std::int32_t>(std::floor(static_cast<double>(samples[i]) * per_unit + 0.5) - low));
  } else {
    for (std::size_t i = 0; i < samples.size(); ++i)
      numbers[i] = static_cast<std::uint16_t>(samples[i] - static_cast<T>(form.low));
  }
  PendingWide pending;
  const VoxelBrick of_numbers = brick_of_numbers(form, brick);
  if (of_numbers.transform_step > 0) {
    // Nothing of it is pending: the transform is complete, and other codes are exact.
    std::vector<std::uint16_t> decoded(numbers.size());
    encode_voxels<std::uint16_t>(numbers, of_numbers, decoded, out).finish();
    numbers.swap(decoded);
  } else {
    pending.code = encode_voxels<std::uint16_t>(numbers, of_numbers, numbers, out);
  }
  const double unit = power_of_two(form.exponent);
  for (std::size_t i = 0; i < samples.size(); ++i) reconstruction[i] = sample_of<T>(form, unit, numbers[i]);
  if (!pending.code.is_complete()) pending.numbers = std::move(numbers);
  return pending;
}

template <class T>
Status decode_narrow(std::span<const std::uint8_t> bytes, const WideBrick& brick, std::span<T> samples,
                     std::vector<std::uint8_t>& carried) {
  if (bytes.size() < head_bytes<T>) return Status::broken("values end too soon");
  NarrowForm form;
  form.low = static_cast<std::int64_t>(take(bytes, 8));
  if constexpr (std::is_floating_point_v<T>) {
    form.exponent = static_cast<std::int16_t>(take(bytes, 2));
    for (std::int64_t& error : form.errors) error = static_cast<std::int64_t>(take(bytes, 2));
  } else {
    form.errors = integer_errors(brick.bounds);
  }
  if (!is_possible<T>(form)) return Status::broken("values with impossible parameters");
  std::vector<std::uint16_t> numbers(samples.size());
  const Status status = decode_voxels<std::uint16_t>(bytes, brick_of_numbers(form, brick), numbers, carried);
  if (!status.ok()) return status;
  const double unit = power_of_two(form.exponent);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = sample_of<T>(form, unit, numbers[i]);
  return {};
}

std::uint64_t working_bytes_of_encoding_narrow(Index3 size, Effort effort, bool transformed) {
  const auto voxels = static_cast<std::uint64_t>(size.x * size.y * size.z);
  return (transformed ? 2 : 1) * voxels * sizeof(std::uint16_t) +
         working_bytes_of_encoding_voxels(SampleType::uint16, size, effort, transformed);
}
std::uint64_t working_bytes_of_decoding_narrow(Index3 size, Effort effort, bool transformed) {
  return static_cast<std::uint64_t>(size.x * size.y * size.z) * sizeof(std::uint16_t) +
         working_bytes_of_decoding_voxels(SampleType::uint16, size, effort, transformed);
}

#define TAGRID_INSTANTIATE(T)                                                                               \
  template std::optional<NarrowForm> narrow_form(std::span<const T>, const WideBounds&, double);            \
  template PendingWide encode_narrow(std::span<const T>, const NarrowForm&, const WideBrick&, std::span<T>, \
                                     std::vector<std::uint8_t>&);                                           \
  template Status decode_narrow(std::span<const std::uint8_t>, const WideBrick&, std::span<T>,              \
                                std::vector<std::uint8_t>&);
TAGRID_FOR_EACH_WIDE_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
