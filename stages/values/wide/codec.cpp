#include "stages/values/wide/codec.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "stages/entropy/rans_coder.h"
#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/voxels/constant_brick.h"
#include "stages/values/voxels/few_brick.h"
#include "stages/values/wide/parameters.h"
#include "stages/values/wide/residual_model.h"
#include "stages/values/wide/window.h"

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
          step_of_numbers(form, brick.transform_step),
          brick.filter,
          brick.sums};
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

namespace {

constexpr std::uint8_t narrow_brick = 2;

// The difference of two numbers as sign and magnitude; for keys of float64 it needs 65 bits.
WideResidual difference(std::int64_t a, std::int64_t b) {
  if (a < b) return {static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a), true};
  return {static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b), false};
}

std::int64_t signed_residual(const WideResidual& r) {
  const auto limited = static_cast<std::int64_t>(std::min(r.magnitude, std::uint64_t{1} << 62));
  return r.negative ? -limited : limited;
}

/// Codes every voxel in raster order. Sum holds weighted sums of numbers. When encoding, `original` and
/// `numbers` are the input; `result` receives the decoded samples.
template <class T, class Sum, class Coder>
class WidePass {
 public:
  WidePass(Coder& coder, const WideBrick& brick, const WideParameters& parameters)
      : coder_(coder),
        owned_(brick.owned),
        activity_(brick.activity),
        bounds_(brick.bounds),
        p_(parameters),
        unit_(parameters.fixed ? power_of_two(parameters.exponent) : 1),
        window_(owned_.size(), parameters.reference, parameters.low, parameters.high),
        residuals_(std::make_unique<WideResidualModel>()),
        corrections_(std::make_unique<WideResidualModel>()) {
    const std::uint64_t span = static_cast<std::uint64_t>(p_.high) - static_cast<std::uint64_t>(p_.low);
    for (std::size_t i = 0; i < 2; ++i) {
      step_[i] = 2 * p_.error[i] + 1;
      largest_[i] = span / static_cast<std::uint64_t>(step_[i]);
      if (largest_[i] < ~std::uint64_t{0}) ++largest_[i];
    }
  }

  /// Returns false if the decoder has run out of bytes, or if a sample needs an escape in a brick without
  /// escapes.
  bool run(const T* original, const WideNumbers* numbers, T* result, std::int64_t slices) {
    const Index3 size = owned_.size();
    std::size_t i = 0;
    for (std::int64_t z = 0; z < slices; ++z) {
      window_.begin_slice(z, z == 0 ? p_.first_slice : p_.others);
      for (std::int64_t y = 0; y < size.y; ++y) {
        window_.begin_row(y);
        if (bounds_.surface_error >= 0) bits_ = activity_->row(owned_.low.y + y, owned_.low.z + z);
        for (std::int64_t x = 0; x < size.x; ++x, ++i) {
          if constexpr (Coder::encoding) {
            if (!code(x, original[i], numbers->numbers[i], numbers->escaped[i] != 0, result[i])) return false;
          } else {
            code(x, T{}, 0, false, result[i]);
          }
        }
        window_.end_row();
        if (coder_.exhausted()) return false;
      }
      window_.end_slice();
    }
    return true;
  }

 private:
  bool active(std::int64_t x) const {
    if (bounds_.surface_error < 0) return false;
    const auto bit = static_cast<std::uint64_t>(x + owned_.low.x - activity_->box().low.x);
    return (bits_[bit / 64] >> (bit % 64)) & 1;
  }

  T sample_of(std::int64_t number) const {
    if constexpr (std::is_floating_point_v<T>)
      if (p_.fixed) return from_fixed_point<T>(number, unit_);
    return from_key<T>(number);
  }

  std::int64_t decoded(const WidePrediction& p, const WideResidual& r, std::size_t which) const {
    const auto steps = static_cast<Sum>(std::min(r.magnitude, largest_[which])) * Sum{step_[which]};
    const Sum number = r.negative ? Sum{p.value} - steps : Sum{p.value} + steps;
    return static_cast<std::int64_t>(std::clamp<Sum>(number, p_.low, p_.high));
  }

  bool is_within(T sample, T original, bool is_active) const {
    const double bound = is_active ? bounds_.surface_error : bounds_.max_error;
    if (bound <= 0) return identical(sample, original);
    return within(static_cast<double>(sample), static_cast<double>(original), bound);
  }

  WideResidual quantized(std::int64_t number, const WidePrediction& prediction, std::size_t which) const {
    const auto error = static_cast<std::uint64_t>(p_.error[which]);
    WideResidual r = difference(number, prediction.value);
    r.magnitude = (r.magnitude + std::min(error, ~r.magnitude)) / static_cast<std::uint64_t>(step_[which]);
    r.negative = r.negative && r.magnitude != 0;
    return r;
  }

  // When decoding, only `x` is input. Returns false if a sample needs an escape in a brick without escapes.
  bool code(std::int64_t x, T original, std::int64_t number, bool escaped, T& result) {
    const WidePrediction prediction = window_.predict(x);
    const bool is_active = active(x), corrected = p_.corrected && is_active;
    const std::size_t which = is_active;
    WideResidual r;
    std::int64_t v = 0;
    if constexpr (Coder::encoding) {
      r = quantized(number, prediction, which);
      v = decoded(prediction, r, which);
    }
    if constexpr (std::is_floating_point_v<T>) {
      if constexpr (Coder::encoding) {
        escaped = escaped || !(corrected || is_within(sample_of(v), original, is_active));
        if (escaped && !p_.escapes) return false;
      }
      if (p_.escapes && code_adaptive(coder_, escaped, escape_[window_.escape_context(x)], 1000)) {
        result = code_escaped(original);
        window_.commit_escape(x, prediction);
        return true;
      }
    }
    r = residuals_->code(coder_, r, window_.context(x, prediction, p_.error[which]));
    if constexpr (!Coder::encoding) v = decoded(prediction, r, which);
    result = sample_of(v);
    if (corrected) result = code_correction(original, result);
    window_.commit(x, prediction, v, signed_residual(r), step_[which]);
    return true;
  }

  // Codes the bits of a sample that has no number. Often they are those of the escaped sample before.
  T code_escaped(T original) {
    if (code_adaptive(coder_, bits_of(original) == last_escaped_, repeats_, 250))
      return std::bit_cast<T>(last_escaped_);
    last_escaped_ = static_cast<BitsOf<T>>(code_raw_bits(coder_, bits_of(original), 8 * sizeof(T)));
    return std::bit_cast<T>(last_escaped_);
  }

  // Leads from a sample on the lattice of fixed-point numbers to the exact one, by the difference of their
  // keys.
  T code_correction(T original, T lattice) {
    const WideResidual d = corrections_->code(coder_, difference(key_of(original), key_of(lattice)),
                                              {log_steps<2>(last_correction_), {}, {}});
    last_correction_ = d.magnitude;
    using Limits = std::numeric_limits<std::make_signed_t<BitsOf<T>>>;
    const Int128 key = Int128{key_of(lattice)} + (d.negative ? -Int128{d.magnitude} : Int128{d.magnitude});
    return from_key<T>(static_cast<std::int64_t>(std::clamp<Int128>(key, Limits::min(), Limits::max())));
  }

  Coder& coder_;
  Box owned_;
  const LatticeBits* activity_;
  WideBounds bounds_;
  const WideParameters& p_;
  double unit_;
  std::array<std::int64_t, 2> step_{};
  std::array<std::uint64_t, 2> largest_{};
  WideWindow<Sum> window_;
  std::unique_ptr<WideResidualModel> residuals_, corrections_;
  std::array<AdaptiveBit, 8> escape_{};
  AdaptiveBit repeats_;
  BitsOf<T> last_escaped_ = 0;
  std::uint64_t last_correction_ = 0;
  const std::uint64_t* bits_ = nullptr;
};

template <class T, class Coder>
bool run_pass(Coder& coder, const WideBrick& brick, const WideParameters& p, const T* original,
              const WideNumbers* numbers, T* result, std::int64_t slices) {
  if constexpr (sizeof(T) == 8)
    if (!p.fixed) return WidePass<T, Int128, Coder>(coder, brick, p).run(original, numbers, result, slices);
  return WidePass<T, std::int64_t, Coder>(coder, brick, p).run(original, numbers, result, slices);
}

// A sample that is within the tightest bound of all others, if there is one.
template <class T>
bool constant_of(std::span<const T> samples, const WideBounds& bounds, T& constant) {
  constant = samples[0];
  if (std::all_of(samples.begin(), samples.end(), [&](T v) { return identical(v, samples[0]); })) return true;
  const double bound =
      bounds.surface_error < 0 ? bounds.max_error : std::min(bounds.max_error, bounds.surface_error);
  if (bound <= 0 || !std::all_of(samples.begin(), samples.end(), is_finite<T>)) return false;
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  constant = std::midpoint(*low, *high);
  return within(static_cast<double>(*low), static_cast<double>(constant), bound) &&
         within(static_cast<double>(*high), static_cast<double>(constant), bound);
}

/// The brick, if it is not coded as narrow numbers. Nothing else is transformed.
template <class T>
WideBrick not_transformed(WideBrick brick) {
  if (!(brick.transform_step > 0)) return brick;
  const double half = brick.transform_step / 2;
  brick.bounds.max_error =
      std::min(brick.bounds.max_error, std::is_floating_point_v<T> ? half : std::floor(half));
  return brick;
}

/// The window and the models.
std::uint64_t working_bytes_of_pass(Index3 size) {
  return WideWindow<std::int64_t>::working_bytes(size) + 2 * sizeof(WideResidualModel);
}

}  // namespace

template <class T>
PendingWide encode_voxels(std::span<const T> samples, const WideBrick& whole, std::span<T> reconstruction,
                          std::vector<std::uint8_t>& out) {
  const WideBrick brick = not_transformed<T>(whole);
  assert(!brick.owned.empty() && static_cast<std::int64_t>(samples.size()) == brick.owned.count());
  assert(reconstruction.size() == samples.size());
  assert(brick.bounds.surface_error < 0 || brick.activity->box().contains(brick.owned));
  T constant;
  if (constant_of(samples, brick.bounds, constant)) {
    append_constant_brick(constant, out);
    std::fill(reconstruction.begin(), reconstruction.end(), constant);
    return {};
  }
  if (const auto form = narrow_form(samples, whole.bounds, whole.transform_step)) {
    out.push_back(narrow_brick);
    return encode_narrow(samples, *form, whole, reconstruction, out);
  }
  if (auto few = encode_few(samples, brick, T{}, T{}, reconstruction, out)) return {{}, std::move(*few)};
  WideNumbers numbers;
  WideParameters parameters = choose_parameters(samples, brick.owned.size(), brick.bounds, numbers);
  const std::size_t start = out.size();
  for (;; parameters.escapes = true) {
    out.resize(start);
    out.push_back(coded_brick);
    RansEncoder coder(out);
    code_wide_parameters<T>(coder, brick.bounds.surface_error >= 0, parameters);
    if (!run_pass(coder, brick, parameters, samples.data(), &numbers, reconstruction.data(),
                  brick.owned.size().z))
      continue;
    coder.finish();
    return {};
  }
}

template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const WideBrick& whole, std::span<T> samples,
                     std::vector<std::uint8_t>& carried) {
  const WideBrick brick = not_transformed<T>(whole);
  const std::int64_t slices = slices_in(brick.owned, samples.size());
  assert(brick.bounds.surface_error < 0 || brick.activity->box().contains(brick.owned));
  if (!bytes.empty() && bytes[0] == narrow_brick)
    return decode_narrow(bytes.subspan(1), whole, samples, carried);
  if (is_few_brick(bytes)) return decode_few(bytes, brick, samples, carried);
  const auto count = static_cast<std::size_t>(brick.owned.count());
  return decode_brick_values(bytes, count, samples, [&](RansDecoder& coder) {
    WideParameters parameters;
    if (!code_wide_parameters<T>(coder, brick.bounds.surface_error >= 0, parameters))
      return Status::broken("values with impossible parameters");
    const T* const no_original = nullptr;
    if (!run_pass(coder, brick, parameters, no_original, nullptr, samples.data(), slices))
      return Status::broken("values end too soon");
    return Status();
  });
}

std::uint64_t working_bytes_of_encoding_wide_voxels(SampleType type, Index3 size, const WideBounds& bounds,
                                                    Effort effort, bool transformed) {
  const auto voxels = static_cast<std::uint64_t>(size.x * size.y * size.z);
  const bool floats = is_float_type(type);
  // Differences of keys, which have a bit more than samples, or of numbers on a lattice, which have 48.
  const int bits = static_cast<int>(8 * size_of(type)) + 1;
  std::uint64_t events = WideResidualModel::most_events(floats ? std::max(bits, 48) : bits);
  if (floats) ++events;                                                                     // escaped?
  if (floats && bounds.surface_error == 0) events += WideResidualModel::most_events(bits);  // corrected
  const std::uint64_t numbers = voxels * (sizeof(std::int64_t) + sizeof(std::uint8_t));
  // The parameters take a few hundred events before the first voxel.
  const std::uint64_t wide =
      numbers + std::max(floats ? numbers : 0,
                         working_bytes_of_pass(size) + RansEncoder::working_bytes(voxels * events + 1024));
  // Numbers that stand for samples take no more than narrow ones; the search for them takes much less.
  return std::max({wide, working_bytes_of_encoding_narrow(size, effort, transformed),
                   working_bytes_of_encoding_few(
                       type, size, working_bytes_of_encoding_voxels(SampleType::uint16, size, effort))});
}

std::uint64_t working_bytes_of_decoding_wide_voxels(SampleType type, Index3 size, Effort effort,
                                                    bool transformed) {
  return std::max(
      {working_bytes_of_pass(size), working_bytes_of_decoding_narrow(size, effort, transformed),
       working_bytes_of_decoding_few(type, size, working_bytes_of_decoding_as_it_is(size, effort))});
}

#define TAGRID_INSTANTIATE(T)                                                                  \
  template PendingWide encode_voxels(std::span<const T>, const WideBrick&, std::span<T>,       \
                                     std::vector<std::uint8_t>&);                              \
  template Status decode_voxels(std::span<const std::uint8_t>, const WideBrick&, std::span<T>, \
                                std::vector<std::uint8_t>&);
TAGRID_FOR_EACH_WIDE_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
