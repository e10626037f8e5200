#include "stages/wide_point_coding.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>

#include "grid/sample_type.h"
#include "stages/rans_coder.h"
#include "stages/wide_numbers.h"
#include "stages/wide_residual_model.h"

namespace tagrid {
namespace {

// floor((2 a + b) / (2 b)): the nearest integer to a / b, halves up. REQUIRES: b > 0.
template <class Sum>
Sum rounded_quotient(Sum a, Sum b) {
  const Sum top = 2 * a + b, bottom = 2 * b;
  return top >= 0 ? top / bottom : -((bottom - 1 - top) / bottom);
}

/// Values as numbers on the lattice that the error of points makes.
template <class T>
class PointLattice {
 public:
  explicit PointLattice(double point_error) {
    if constexpr (std::is_integral_v<T>)
      step_ = 2 * static_cast<std::int64_t>(std::min(point_error, 4294967295.0)) + 1;
    else
      spacing_ = 2 * point_error;
  }

  /// Whether `value` may be a value of the lattice; then its number.
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
  /// Numbers that a decoder accepts.
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

// Codes the values in both directions. Sum holds the weighted sums of numbers of a prediction.
template <class T, class Sum, class Coder>
class WidePointModel {
 public:
  WidePointModel(Coder& coder, const LatticeBits& active, int cube_size, const PointLattice<T>& lattice,
                 T* values)
      : coder_(coder),
        active_(active),
        box_(active.box()),
        cube_size_(cube_size),
        lattice_(lattice),
        values_(values),
        numbers_(static_cast<std::size_t>(box_.count())),
        dy_(box_.size().x),
        dz_(box_.size().x * box_.size().y),
        models_(7) {}

  void run(bool escapes) {
    escapes_ = coder_.code_raw(escapes, 1) != 0;
    code_root_corners();
    for (std::int64_t unit = cube_size_ / 2; unit >= 1; unit /= 2)
      for (int odd_count = 3; odd_count >= 1; --odd_count)
        for (unsigned axes = 1; axes < 8; ++axes)
          if (std::popcount(axes) == odd_count) code_pass(unit, axes);
  }

 private:
  void code_root_corners() {
    const std::int64_t s = cube_size_;
    for (std::int64_t z = box_.low.z; z <= box_.high.z; z += s)
      for (std::int64_t y = box_.low.y; y <= box_.high.y; y += s)
        for (std::int64_t x = box_.low.x; x <= box_.high.x; x += s) {
          const std::int64_t at = box_.offset({x, y, z});
          const std::int64_t before = x > box_.low.x   ? at - s
                                      : y > box_.low.y ? at - s * dy_
                                      : z > box_.low.z ? at - s * dz_
                                                       : -1;
          code(at, before < 0 ? 0 : number(before), 0, 0);
        }
  }

  void code_pass(std::int64_t unit, unsigned axes) {
    const bool odd[3] = {(axes & 1) != 0, (axes & 2) != 0, (axes & 4) != 0};
    std::vector<std::uint64_t> mask(active_.words_per_row());
    for (std::int64_t x = odd[0] ? unit : 0; x < box_.size().x; x += 2 * unit)
      mask[static_cast<std::size_t>(x / 64)] |= std::uint64_t{1} << (x % 64);
    for (std::int64_t z = box_.low.z + (odd[2] ? unit : 0); z <= box_.high.z; z += 2 * unit)
      for (std::int64_t y = box_.low.y + (odd[1] ? unit : 0); y <= box_.high.y; y += 2 * unit) {
        const std::uint64_t* row = active_.row(y, z);
        for (std::size_t i = 0; i < mask.size(); ++i)
          for (std::uint64_t rest = row[i] & mask[i]; rest != 0; rest &= rest - 1)
            code_point({box_.low.x + static_cast<std::int64_t>(64 * i) + std::countr_zero(rest), y, z}, unit,
                       axes);
      }
  }

  // Predicts from the vertices of the diamond, as point_coding does.
  void code_point(Index3 p, std::int64_t unit, unsigned axes) {
    const std::int64_t at = box_.offset(p), step[3] = {unit, unit * dy_, unit * dz_};
    std::int64_t least = std::numeric_limits<std::int64_t>::max(), most = ~least;
    Sum corner_sum = 0, side_sum = 0, corners = 0, sides = 0;
    const auto see = [&](std::int64_t where) {
      const std::int64_t v = number(where);
      least = std::min(least, v);
      most = std::max(most, v);
      return Sum{v};
    };
    for (unsigned signs = 0; signs < 8; ++signs) {
      if ((signs & ~axes) != 0) continue;
      std::int64_t offset = 0;
      for (int axis = 0; axis < 3; ++axis)
        if (axes >> axis & 1) offset += (signs >> axis & 1) ? step[axis] : -step[axis];
      corner_sum += see(at + offset);
      ++corners;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (axes >> axis & 1) continue;
      if (p[axis] > box_.low[axis]) side_sum += see(at - step[axis]), ++sides;
      if (p[axis] < box_.high[axis]) side_sum += see(at + step[axis]), ++sides;
    }
    Sum guess;
    if (sides == 0)
      guess = rounded_quotient<Sum>(corner_sum, corners);
    else if (corners == 4)
      guess = rounded_quotient<Sum>(corner_sum * sides + 2 * side_sum * corners, 3 * corners * sides);
    else
      guess = rounded_quotient<Sum>(corner_sum + side_sum, corners + sides);
    const auto kind = static_cast<std::size_t>(corners == 8 ? 1 : corners == 4 ? 2 : 3) + (unit == 1 ? 3 : 0);
    code(at, static_cast<std::int64_t>(guess), kind,
         static_cast<std::uint64_t>(most) - static_cast<std::uint64_t>(least));
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
  void code_escaped(T& value) {
    if (!code_adaptive(coder_, bits_of(value) == last_escaped_, repeats_, 250))
      last_escaped_ = static_cast<BitsOf<T>>(code_raw_bits(coder_, bits_of(value), 8 * sizeof(T)));
    if constexpr (!Coder::encoding) value = std::bit_cast<T>(last_escaped_);
  }

  Coder& coder_;
  const LatticeBits& active_;
  Box box_;
  int cube_size_;
  const PointLattice<T>& lattice_;
  T* values_;
  std::vector<std::int64_t> numbers_;  ///< of the points that are known; an escaped one has its guess
  std::int64_t dy_, dz_;
  std::vector<WideResidualModel> models_;
  bool escapes_ = false;
  std::array<AdaptiveBit, 2> escape_{};
  std::size_t was_escape_ = 0;
  AdaptiveBit repeats_;
  BitsOf<T> last_escaped_ = 0;
};

template <class T, class Coder>
void run_model(Coder& coder, const LatticeBits& active, int cube_size, double point_error, T* values,
               bool escapes) {
  const PointLattice<T> lattice(point_error);
  if constexpr (sizeof(T) == 8)
    if (point_error == 0)
      return WidePointModel<T, Int128, Coder>(coder, active, cube_size, lattice, values).run(escapes);
  WidePointModel<T, std::int64_t, Coder>(coder, active, cube_size, lattice, values).run(escapes);
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
  // The model writes to its values only when it decodes.
  run_model<T>(coder, active, cube_size, point_error, const_cast<T*>(values.data()), escapes);
  coder.finish();
}

template <class T>
Status decode_wide_points(std::span<const std::uint8_t> bytes, const LatticeBits& active, int cube_size,
                          double point_error, std::span<T> values) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  RansDecoder coder(bytes);
  run_model<T>(coder, active, cube_size, point_error, values.data(), false);
  if (!coder.finished()) return Status::broken("the values of the grid have the wrong number of bytes");
  return {};
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
