#include "stages/values/points/coding.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <type_traits>

#include "stages/bound/bounds.h"
#include "stages/entropy/adaptive_bit.h"
#include "stages/entropy/rans_coder.h"
#include "stages/sample/numbers.h"
#include "stages/values/points/order.h"
#include "stages/values/wide/residual_model.h"

namespace tagrid {
namespace {

/// Converts values to numbers on the lattice that the error of points defines, and back.
template <class T>
class PointLattice {
 public:
  explicit PointLattice(double point_error) {
    if constexpr (std::is_integral_v<T>)
      step_ = 2 * integer_bound<T>(point_error) + 1;
    else
      spacing_ = 2 * point_error;
  }

  /// Returns false if `value` cannot be a value of the lattice; otherwise sets its number.
  bool number_of(T value, std::int64_t& number) const {
    if constexpr (std::is_integral_v<T>) {
      number = nearest(value);
      return true;
    } else {
      if (!std::isfinite(value)) return false;
      if (spacing_ == 0) {
        number = key_of(value);
        return true;
      }
      const double nearest = std::floor(static_cast<double>(value) / spacing_ + 0.5);
      if (!(std::fabs(nearest) <= static_cast<double>(largest_fixed))) return false;
      number = static_cast<std::int64_t>(nearest);
      return true;
    }
  }
  T value_of(std::int64_t number) const {
    if constexpr (std::is_integral_v<T>) {
      constexpr std::int64_t low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
      return static_cast<T>(std::clamp(number * step_, low, high));
    } else {
      return spacing_ == 0 ? from_key<T>(number) : from_fixed_point<T>(number, spacing_);
    }
  }
  bool holds(T value) const {
    std::int64_t number;
    return number_of(value, number) && identical(value_of(number), value);
  }
  /// The range of numbers that a decoder accepts.
  std::int64_t least() const { return -most() - (std::is_floating_point_v<T> && spacing_ == 0); }
  std::int64_t most() const {
    if constexpr (std::is_integral_v<T>) return (std::int64_t{1} << 32) / step_ + 1;
    if constexpr (std::is_floating_point_v<T>)
      return spacing_ != 0 ? largest_fixed : std::numeric_limits<std::make_signed_t<BitsOf<T>>>::max();
  }

  // Of integers.
  std::int64_t step() const { return step_; }
  std::int64_t nearest(std::int64_t value) const { return rounded_quotient<std::int64_t>(value, step_); }

 private:
  std::int64_t step_ = 1;
  double spacing_ = 0;
};

/// Values that are read when encoding, and filled on the way when decoding.
template <class T, class Coder>
using CodedValue = std::conditional_t<Coder::encoding, const T, T>;

// The models code one value in both directions: code(at, guess, kind, spread). known(at) is the number from
// which others are predicted.
template <class T, class Coder>
class NarrowPointModel {
 public:
  using Value = CodedValue<T, Coder>;
  using Sum = std::int64_t;
  static constexpr std::size_t spread_contexts = 24;

  NarrowPointModel(Coder& coder, const PointLattice<T>& lattice, const Box&, Value* values, bool)
      : coder_(coder), lattice_(lattice), values_(values), models_(diamond_kinds * spread_contexts) {}

  bool is_possible() const { return true; }
  std::int64_t known(std::int64_t at) const { return values_[at]; }

  void code(std::int64_t at, std::int64_t guess, std::size_t kind, std::uint64_t spread) {
    const auto steps =
        static_cast<std::size_t>(std::bit_width(spread * 4 / static_cast<std::uint64_t>(lattice_.step())));
    IntegerModel& model = models_[kind * spread_contexts + std::min(steps, spread_contexts - 1)];
    const std::int64_t guessed = lattice_.nearest(guess);
    const std::int64_t residual =
        model.code_signed(coder_, Coder::encoding ? lattice_.nearest(values_[at]) - guessed : 0);
    if constexpr (!Coder::encoding)
      values_[at] = lattice_.value_of(guessed + residual % (std::int64_t{1} << 40));
  }

 private:
  Coder& coder_;
  const PointLattice<T>& lattice_;
  Value* values_;
  std::vector<IntegerModel> models_;
};

// WeightedSum is wide enough for the weighted sums of numbers in a prediction.
template <class T, class WeightedSum, class Coder>
class WidePointModel {
 public:
  using Value = CodedValue<T, Coder>;
  using Sum = WeightedSum;

  WidePointModel(Coder& coder, const PointLattice<T>& lattice, const Box& box, Value* values, bool escapes)
      : coder_(coder),
        lattice_(lattice),
        values_(values),
        numbers_(static_cast<std::size_t>(box.count())),
        models_(diamond_kinds),
        escapes_(coder.code_raw(escapes, 1) != 0) {}

  /// False if integers have escapes, which no encoder writes.
  bool is_possible() const { return !std::is_integral_v<T> || !escapes_; }
  std::int64_t known(std::int64_t at) const { return numbers_[static_cast<std::size_t>(at)]; }

  void code(std::int64_t at, std::int64_t guess, std::size_t kind, std::uint64_t spread) {
    std::int64_t exact = 0;
    std::int64_t& number = numbers_[static_cast<std::size_t>(at)];
    bool escaped = false;
    if constexpr (Coder::encoding)
      escaped = !lattice_.number_of(values_[at], exact) || !identical(lattice_.value_of(exact), values_[at]);
    if constexpr (std::is_floating_point_v<T>)
      if (escapes_ && code_adaptive(coder_, escaped, escape_[was_escape_], 250)) {
        was_escape_ = 1;
        number = guess;
        code_escaped(values_[at]);
        return;
      }
    was_escape_ = 0;
    WideResidual r;
    r.negative = exact < guess;
    r.magnitude = r.negative ? static_cast<std::uint64_t>(guess) - static_cast<std::uint64_t>(exact)
                             : static_cast<std::uint64_t>(exact) - static_cast<std::uint64_t>(guess);
    r = models_[kind].code(coder_, r, {log_steps<2>(spread), {}, {}});
    const Int128 sum = Int128{guess} + (r.negative ? -Int128{r.magnitude} : Int128{r.magnitude});
    number = static_cast<std::int64_t>(std::clamp<Int128>(sum, lattice_.least(), lattice_.most()));
    if constexpr (!Coder::encoding) values_[at] = lattice_.value_of(number);
  }

 private:
  // The bits of a value that is not on the lattice; often those of the one before.
  void code_escaped(Value& value) {
    if (!code_adaptive(coder_, bits_of(value) == last_escaped_, repeats_, 250))
      last_escaped_ = static_cast<BitsOf<T>>(code_raw_bits(coder_, bits_of(value), 8 * sizeof(T)));
    if constexpr (!Coder::encoding) value = std::bit_cast<T>(last_escaped_);
  }

  Coder& coder_;
  const PointLattice<T>& lattice_;
  Value* values_;
  std::vector<std::int64_t> numbers_;  ///< of the points that are known; an escaped one has its guess
  std::vector<WideResidualModel> models_;
  bool escapes_;
  std::array<AdaptiveBit, 2> escape_{};
  std::size_t was_escape_ = 0;
  AdaptiveBit repeats_;
  BitsOf<T> last_escaped_ = 0;
};

/// Returns false if no encoder writes such values. Ends early if the decoder has run out of bytes.
template <class Model, class T, class Coder>
bool run_model(Coder& coder, const LatticeBits& active, int cube_size, const PointLattice<T>& lattice,
               CodedValue<T, Coder>* values, bool escapes) {
  const Box& box = active.box();
  Model model(coder, lattice, box, values, escapes);
  if (!model.is_possible()) return false;
  for_points_coarse_to_fine(
      active, cube_size,
      [&](std::int64_t at, std::int64_t before) {
        model.code(at, before < 0 ? 0 : model.known(before), 0, 0);
      },
      [&](Index3 p, std::int64_t unit, unsigned axes) {
        const auto guess = predict_from_diamond<typename Model::Sum>(
            box, p, unit, axes, [&](std::int64_t at) { return model.known(at); });
        model.code(box.offset(p), static_cast<std::int64_t>(guess.value), guess.kind,
                   static_cast<std::uint64_t>(guess.high) - static_cast<std::uint64_t>(guess.low));
      },
      [&] { return !coder.exhausted(); });
  return true;
}

template <class T, class Coder>
bool code_points(Coder& coder, const LatticeBits& active, int cube_size, double point_error,
                 CodedValue<T, Coder>* values, bool escapes) {
  const PointLattice<T> lattice(point_error);
  if constexpr (!is_wide<T>)
    return run_model<NarrowPointModel<T, Coder>>(coder, active, cube_size, lattice, values, escapes);
  if constexpr (sizeof(T) == 8)
    if (point_error == 0)
      return run_model<WidePointModel<T, Int128, Coder>>(coder, active, cube_size, lattice, values, escapes);
  if constexpr (is_wide<T>)
    return run_model<WidePointModel<T, std::int64_t, Coder>>(coder, active, cube_size, lattice, values,
                                                             escapes);
}

}  // namespace

template <class T>
T stored_point(T value, double point_error) {
  const PointLattice<T> lattice(point_error);
  std::int64_t number;
  if (!lattice.number_of(value, number)) return value;
  const T stored = lattice.value_of(number);
  if constexpr (std::is_floating_point_v<T>)
    if (!within(static_cast<double>(stored), static_cast<double>(value), point_error)) return value;
  return stored;
}

template <class T>
void encode_points(std::span<const T> values, const LatticeBits& active, int cube_size, double point_error,
                   std::vector<std::uint8_t>& out) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  bool escapes = false;
  if constexpr (std::is_floating_point_v<T>) {
    const PointLattice<T> lattice(point_error);
    for_each_set(active, [&](Index3, std::size_t i) { escapes = escapes || !lattice.holds(values[i]); });
  }
  RansEncoder coder(out);
  code_points<T>(coder, active, cube_size, point_error, values.data(), escapes);
  coder.finish();
}

template <class T>
Status decode_points(std::span<const std::uint8_t> bytes, const LatticeBits& active, int cube_size,
                     double point_error, std::span<T> values) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  RansDecoder coder(bytes);
  if (!code_points<T>(coder, active, cube_size, point_error, values.data(), false))
    return Status::broken("values of integers that escape");
  if (coder.exhausted()) return Status::broken("the values of the grid end too soon");
  if (!coder.finished()) return Status::broken("the values of the grid have the wrong number of bytes");
  return {};
}

std::uint64_t working_bytes_of_encoding_points(SampleType type, Index3 size) {
  const auto points = static_cast<std::uint64_t>(size.x * size.y * size.z);
  // A residual has one bit more than its numbers, and a sign; floats on a lattice have 48 bits.
  const int bits = static_cast<int>(8 * size_of(type)) + 1;
  const bool floats = is_float_type(type);
  const std::uint64_t events =
      is_wide_type(type) ? WideResidualModel::most_events(floats ? std::max(bits, 48) : bits) + floats
                         : IntegerModel::most_events(bits);
  return working_bytes_of_decoding_points(type, size) +
         RansEncoder::working_bytes(points * events + is_wide_type(type));
}

std::uint64_t working_bytes_of_decoding_points(SampleType type, Index3 size) {
  constexpr std::size_t narrow_models =
      NarrowPointModel<std::uint8_t, RansDecoder>::spread_contexts * sizeof(IntegerModel);
  const std::uint64_t numbers =
      is_wide_type(type) ? static_cast<std::uint64_t>(size.x * size.y * size.z) * sizeof(std::int64_t) : 0;
  return diamond_kinds * (is_wide_type(type) ? sizeof(WideResidualModel) : narrow_models) + numbers +
         LatticeBits::working_bytes({size.x, 1, 1});
}

#define TAGRID_INSTANTIATE(T)                                                      \
  template T stored_point(T, double);                                              \
  template void encode_points(std::span<const T>, const LatticeBits&, int, double, \
                              std::vector<std::uint8_t>&);                         \
  template Status decode_points(std::span<const std::uint8_t>, const LatticeBits&, int, double, std::span<T>);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
