#include "stages/point_coding.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>

#include "grid/lattice.h"
#include "grid/sample_type.h"
#include "stages/integer_model.h"
#include "stages/rans_coder.h"

namespace tagrid {
namespace {

// Nearest multiple, in steps; halves go up.
std::int64_t to_steps(std::int64_t value, std::int64_t step) {
  const std::int64_t shifted = 2 * value + step;
  return shifted >= 0 ? shifted / (2 * step) : -((2 * step - 1 - shifted) / (2 * step));
}

template <class T>
T from_steps(std::int64_t steps, std::int64_t step) {
  return static_cast<T>(
      std::clamp<std::int64_t>(steps * step, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
}

// Codes the values in both directions. When decoding, `values` is filled on the way; when encoding, what
// is written to it is what it holds already.
template <class T, class Coder>
class PointModel {
 public:
  PointModel(Coder& coder, const LatticeBits& active, int cube_size, std::int64_t point_error, T* values)
      : coder_(coder),
        active_(active),
        box_(active.box()),
        cube_size_(cube_size),
        step_(2 * point_error + 1),
        values_(values),
        dy_(box_.size().x),
        dz_(box_.size().x * box_.size().y),
        models_(7 * contexts) {}

  /// False where the decoder has run out of bytes.
  bool run() {
    if (!code_root_corners()) return false;
    for (std::int64_t unit = cube_size_ / 2; unit >= 1; unit /= 2)
      for (int odd_count = 3; odd_count >= 1; --odd_count)
        for (unsigned axes = 1; axes < 8; ++axes)
          if (std::popcount(axes) == odd_count && !code_pass(unit, axes)) return false;
    return true;
  }

 private:
  static constexpr std::size_t contexts = 24;
  static constexpr std::int64_t limit = std::int64_t{1} << 34;  // beyond any sample and any residual

  T& at(Index3 p) { return values_[box_.offset(p)]; }

  // Looked at once a row: what follows the end of the bytes is not worth decoding.
  bool exhausted() const {
    if constexpr (Coder::encoding)
      return false;
    else
      return coder_.exhausted();
  }

  bool code_root_corners() {
    const std::int64_t s = cube_size_;
    for (std::int64_t z = box_.low.z; z <= box_.high.z; z += s)
      for (std::int64_t y = box_.low.y; y <= box_.high.y; y += s) {
        for (std::int64_t x = box_.low.x; x <= box_.high.x; x += s) {
          std::int64_t guess = 0;
          if (x > box_.low.x)
            guess = at({x - s, y, z});
          else if (y > box_.low.y)
            guess = at({x, y - s, z});
          else if (z > box_.low.z)
            guess = at({x, y, z - s});
          code(at({x, y, z}), guess, 0, 0);
        }
        if (exhausted()) return false;
      }
    return true;
  }

  bool code_pass(std::int64_t unit, unsigned axes) {
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
        if (exhausted()) return false;
      }
    return true;
  }

  // Predicts from the vertices of the diamond: the points one unit away along every even axis, all sign
  // combinations along the odd ones.
  void code_point(Index3 p, std::int64_t unit, unsigned axes) {
    T* const here = &at(p);
    const std::int64_t step[3] = {unit, unit * dy_, unit * dz_};
    std::int64_t corner_sum = 0, low = std::numeric_limits<std::int64_t>::max(), high = -low, corners = 0;
    const auto see = [&](std::int64_t v) {
      low = std::min(low, v);
      high = std::max(high, v);
      return v;
    };
    for (unsigned signs = 0; signs < 8; ++signs) {
      if ((signs & ~axes) != 0) continue;
      std::int64_t offset = 0;
      for (int axis = 0; axis < 3; ++axis)
        if (axes >> axis & 1) offset += (signs >> axis & 1) ? step[axis] : -step[axis];
      corner_sum += see(here[offset]);
      ++corners;
    }
    std::int64_t side_sum = 0, sides = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (axes >> axis & 1) continue;
      if (p[axis] > box_.low[axis]) side_sum += see(here[-step[axis]]), ++sides;
      if (p[axis] < box_.high[axis]) side_sum += see(here[step[axis]]), ++sides;
    }
    // The sides of a face centre are cube centres, closer to it than the corners: 2 : 1. An edge midpoint
    // takes the plain mean of its neighbours on the axes.
    std::int64_t guess;
    if (sides == 0) {
      guess = to_steps(corner_sum, corners);
    } else if (corners == 4) {
      guess = to_steps(corner_sum * sides + 2 * side_sum * corners, 3 * corners * sides);
    } else {
      guess = to_steps(corner_sum + side_sum, corners + sides);
    }
    const auto spread = static_cast<std::uint64_t>(high - low) * 4 / static_cast<std::uint64_t>(step_);
    const auto context =
        std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(spread)), contexts - 1);
    const auto kind = static_cast<std::size_t>(corners == 8 ? 1 : corners == 4 ? 2 : 3) + (unit == 1 ? 3 : 0);
    code(*here, guess, kind, context);
  }

  void code(T& value, std::int64_t guess, std::size_t kind, std::size_t context) {
    const std::int64_t guessed_steps = to_steps(guess, step_);
    const std::int64_t residual = models_[kind * contexts + context].code_signed(
        coder_, Coder::encoding ? to_steps(value, step_) - guessed_steps : 0);
    if constexpr (!Coder::encoding)
      value = from_steps<T>(guessed_steps + residual % (std::int64_t{1} << 40), step_);
  }

  Coder& coder_;
  const LatticeBits& active_;
  Box box_;
  int cube_size_;
  std::int64_t step_;
  T* values_;
  std::int64_t dy_, dz_;
  std::vector<IntegerModel> models_;
};

}  // namespace

template <class T>
T stored_point(T value, std::int64_t point_error) {
  const std::int64_t step = 2 * point_error + 1;
  return from_steps<T>(to_steps(value, step), step);
}

template <class T>
void encode_points(std::span<const T> values, const LatticeBits& active, int cube_size,
                   std::int64_t point_error, std::vector<std::uint8_t>& out) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  RansEncoder coder(out);
  // The model writes to its values only when it decodes.
  PointModel<T, RansEncoder>(coder, active, cube_size, point_error, const_cast<T*>(values.data())).run();
  coder.finish();
}

template <class T>
Status decode_points(std::span<const std::uint8_t> bytes, const LatticeBits& active, int cube_size,
                     std::int64_t point_error, std::span<T> values) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  RansDecoder coder(bytes);
  PointModel<T, RansDecoder> model(coder, active, cube_size, point_error, values.data());
  if (!model.run()) return Status::broken("the values of the grid end too soon");
  if (!coder.finished()) return Status::broken("the values of the grid have the wrong number of bytes");
  return {};
}

#define TAGRID_INSTANTIATE(T)                                                                         \
  template T stored_point(T, std::int64_t);                                                           \
  template void encode_points(std::span<const T>, const LatticeBits&, int, std::int64_t,              \
                              std::vector<std::uint8_t>&);                                            \
  template Status decode_points(std::span<const std::uint8_t>, const LatticeBits&, int, std::int64_t, \
                                std::span<T>);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
