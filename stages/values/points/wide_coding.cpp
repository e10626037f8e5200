#include "stages/values/points/wide_coding.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <type_traits>

#include "stages/entropy/rans_coder.h"
#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"
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
      step_ = 2 * static_cast<std::int64_t>(std::min(point_error, 4294967295.0)) + 1;
    else
      spacing_ = 2 * point_error;
  }

  /// Returns false if `value` cannot be a value of the lattice; otherwise sets its number.
  bool number_of(T value, std::int64_t& number) const {
    if constexpr (std::is_integral_v<T>) {
      number = rounded_quotient<std::int64_t>(value, step_);
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
  /// The range of numbers that a decoder accepts.
  std::int64_t least() const { return -most() - (std::is_floating_point_v<T> && spacing_ == 0); }
  std::int64_t most() const {
    if constexpr (std::is_integral_v<T>) return (std::int64_t{1} << 32) / step_ + 1;
    if constexpr (std::is_floating_point_v<T>)
      return spacing_ != 0 ? largest_fixed : std::numeric_limits<std::make_signed_t<BitsOf<T>>>::max();
  }

 private:
  std::int64_t step_ = 1;
  double spacing_ = 0;
};

// Codes the values in both directions. Sum is wide enough for the weighted sums of numbers in a prediction.
template <class T, class Sum, class Coder>
class WidePointModel {
 public:
  using Value = std::conditional_t<Coder::encoding, const T, T>;

  WidePointModel(Coder& coder, const LatticeBits& active, int cube_size, const PointLattice<T>& lattice,
                 Value* values)
      : coder_(coder),
        active_(active),
        cube_size_(cube_size),
        lattice_(lattice),
        values_(values),
        numbers_(static_cast<std::size_t>(active.box().count())),
        models_(diamond_kinds) {}

  /// Returns false if integers have escapes, which no encoder writes.
  bool run(bool escapes) {
    escapes_ = coder_.code_raw(escapes, 1) != 0;
    if (std::is_integral_v<T> && escapes_) return false;
    for_points_coarse_to_fine(
        active_, cube_size_,
        [&](std::int64_t at, std::int64_t before) { code(at, before < 0 ? 0 : number(before), 0, 0); },
        [&](Index3 p, std::int64_t unit, unsigned axes) { code_point(p, unit, axes); },
        [&] { return !coder_.exhausted(); });
    return true;
  }

 private:
  void code_point(Index3 p, std::int64_t unit, unsigned axes) {
    const auto guess =
        predict_from_diamond<Sum>(active_.box(), p, unit, axes, [&](std::int64_t at) { return number(at); });
    code(active_.box().offset(p), static_cast<std::int64_t>(guess.value), guess.kind,
         static_cast<std::uint64_t>(guess.high) - static_cast<std::uint64_t>(guess.low));
  }

  std::int64_t& number(std::int64_t at) { return numbers_[static_cast<std::size_t>(at)]; }

  void code(std::int64_t at, std::int64_t guess, std::size_t kind, std::uint64_t spread) {
    std::int64_t exact = 0;
    bool escaped = false;
    if constexpr (Coder::encoding)
      escaped = !lattice_.number_of(values_[at], exact) || !identical(lattice_.value_of(exact), values_[at]);
    if constexpr (std::is_floating_point_v<T>)
      if (escapes_ && code_adaptive(coder_, escaped, escape_[was_escape_], 250)) {
        was_escape_ = 1;
        number(at) = guess;
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
    number(at) = static_cast<std::int64_t>(std::clamp<Int128>(sum, lattice_.least(), lattice_.most()));
    if constexpr (!Coder::encoding) values_[at] = lattice_.value_of(number(at));
  }

  // The bits of a value that is not on the lattice; often those of the one before.
  void code_escaped(Value& value) {
    if (!code_adaptive(coder_, bits_of(value) == last_escaped_, repeats_, 250))
      last_escaped_ = static_cast<BitsOf<T>>(code_raw_bits(coder_, bits_of(value), 8 * sizeof(T)));
    if constexpr (!Coder::encoding) value = std::bit_cast<T>(last_escaped_);
  }

  Coder& coder_;
  const LatticeBits& active_;
  int cube_size_;
  const PointLattice<T>& lattice_;
  Value* values_;
  std::vector<std::int64_t> numbers_;  ///< of the points that are known; an escaped one has its guess
  std::vector<WideResidualModel> models_;
  bool escapes_ = false;
  std::array<AdaptiveBit, 2> escape_{};
  std::size_t was_escape_ = 0;
  AdaptiveBit repeats_;
  BitsOf<T> last_escaped_ = 0;
};

template <class T, class Coder>
bool run_model(Coder& coder, const LatticeBits& active, int cube_size, double point_error,
               std::conditional_t<Coder::encoding, const T, T>* values, bool escapes) {
  const PointLattice<T> lattice(point_error);
  if constexpr (sizeof(T) == 8)
    if (point_error == 0)
      return WidePointModel<T, Int128, Coder>(coder, active, cube_size, lattice, values).run(escapes);
  return WidePointModel<T, std::int64_t, Coder>(coder, active, cube_size, lattice, values).run(escapes);
}

}  // namespace

template <class T>
T stored_wide_point(T value, double point_error) {
  const PointLattice<T> lattice(point_error);
  std::int64_t number;
  if (!lattice.number_of(value, number)) return value;
  const T stored = lattice.value_of(number);
  if constexpr (std::is_floating_point_v<T>)
    if (!within(static_cast<double>(stored), static_cast<double>(value), point_error)) return value;
  return stored;
}

template <class T>
void encode_wide_points(std::span<const T> values, const LatticeBits& active, int cube_size,
                        double point_error, std::vector<std::uint8_t>& out) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  bool escapes = false;
  if constexpr (std::is_floating_point_v<T>) {
    const PointLattice<T> lattice(point_error);
    const Box& box = active.box();
    const T* value = values.data();
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
        for (std::int64_t x = box.low.x; x <= box.high.x; ++x, ++value) {
          std::int64_t number;
          escapes = escapes || (active.test({x, y, z}) && (!lattice.number_of(*value, number) ||
                                                           !identical(lattice.value_of(number), *value)));
        }
  }
  RansEncoder coder(out);
  run_model<T>(coder, active, cube_size, point_error, values.data(), escapes);
  coder.finish();
}

template <class T>
Status decode_wide_points(std::span<const std::uint8_t> bytes, const LatticeBits& active, int cube_size,
                          double point_error, std::span<T> values) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  RansDecoder coder(bytes);
  if (!run_model<T>(coder, active, cube_size, point_error, values.data(), false))
    return Status::broken("values of integers that escape");
  if (!coder.finished()) return Status::broken("the values of the grid have the wrong number of bytes");
  return {};
}

std::uint64_t working_bytes_of_encoding_wide_points(SampleType type, Index3 size) {
  const auto points = static_cast<std::uint64_t>(size.x * size.y * size.z);
  // Residuals of integers or keys have a bit more than samples, those of numbers on a lattice 48.
  const int bits = static_cast<int>(8 * size_of(type)) + 1;
  const bool floats = is_float_type(type);
  const std::uint64_t events = WideResidualModel::most_events(floats ? std::max(bits, 48) : bits) + floats;
  return working_bytes_of_decoding_wide_points(size) + RansEncoder::working_bytes(points * events + 1);
}

std::uint64_t working_bytes_of_decoding_wide_points(Index3 size) {
  return static_cast<std::uint64_t>(size.x * size.y * size.z) * sizeof(std::int64_t) +
         diamond_kinds * sizeof(WideResidualModel) + LatticeBits::working_bytes({size.x, 1, 1});
}

#define TAGRID_INSTANTIATE(T)                                                                        \
  template T stored_wide_point(T, double);                                                           \
  template void encode_wide_points(std::span<const T>, const LatticeBits&, int, double,              \
                                   std::vector<std::uint8_t>&);                                      \
  template Status decode_wide_points(std::span<const std::uint8_t>, const LatticeBits&, int, double, \
                                     std::span<T>);
TAGRID_FOR_EACH_WIDE_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
