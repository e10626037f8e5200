#include "stages/values/points/coding.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <type_traits>

#include "stages/entropy/integer_model.h"
#include "stages/entropy/rans_coder.h"
#include "stages/sample/sample_type.h"
#include "stages/values/points/order.h"

namespace tagrid {
namespace {

template <class T>
T from_steps(std::int64_t steps, std::int64_t step) {
  return static_cast<T>(
      std::clamp<std::int64_t>(steps * step, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
}

constexpr std::size_t spread_contexts = 24;

// Codes the values in both directions. When decoding, `values` is filled on the way.
template <class T, class Coder>
class PointModel {
 public:
  using Value = std::conditional_t<Coder::encoding, const T, T>;

  PointModel(Coder& coder, const LatticeBits& active, int cube_size, std::int64_t point_error, Value* values)
      : coder_(coder),
        active_(active),
        cube_size_(cube_size),
        step_(2 * point_error + 1),
        values_(values),
        models_(diamond_kinds * spread_contexts) {}

  /// Returns false if the decoder has run out of bytes.
  bool run() {
    return for_points_coarse_to_fine(
        active_, cube_size_,
        [&](std::int64_t at, std::int64_t before) {
          code(values_[at], before < 0 ? 0 : std::int64_t{values_[before]}, 0, 0);
        },
        [&](Index3 p, std::int64_t unit, unsigned axes) { code_point(p, unit, axes); },
        // Checked once per row: decoding past the end of the bytes is useless.
        [&] { return !coder_.exhausted(); });
  }

 private:
  void code_point(Index3 p, std::int64_t unit, unsigned axes) {
    const auto guess = predict_from_diamond<std::int64_t>(
        active_.box(), p, unit, axes, [&](std::int64_t at) { return std::int64_t{values_[at]}; });
    const auto spread =
        static_cast<std::uint64_t>(guess.high - guess.low) * 4 / static_cast<std::uint64_t>(step_);
    const auto context =
        std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(spread)), spread_contexts - 1);
    code(values_[active_.box().offset(p)], guess.value, guess.kind, context);
  }

  void code(Value& value, std::int64_t guess, std::size_t kind, std::size_t context) {
    const std::int64_t guessed_steps = rounded_quotient<std::int64_t>(guess, step_);
    const std::int64_t residual = models_[kind * spread_contexts + context].code_signed(
        coder_, Coder::encoding ? rounded_quotient<std::int64_t>(value, step_) - guessed_steps : 0);
    if constexpr (!Coder::encoding)
      value = from_steps<T>(guessed_steps + residual % (std::int64_t{1} << 40), step_);
  }

  Coder& coder_;
  const LatticeBits& active_;
  int cube_size_;
  std::int64_t step_;
  Value* values_;
  std::vector<IntegerModel> models_;
};

}  // namespace

template <class T>
T stored_point(T value, std::int64_t point_error) {
  const std::int64_t step = 2 * point_error + 1;
  return from_steps<T>(rounded_quotient<std::int64_t>(value, step), step);
}

template <class T>
void encode_points(std::span<const T> values, const LatticeBits& active, int cube_size,
                   std::int64_t point_error, std::vector<std::uint8_t>& out) {
  assert(static_cast<std::int64_t>(values.size()) == active.box().count());
  RansEncoder coder(out);
  PointModel<T, RansEncoder>(coder, active, cube_size, point_error, values.data()).run();
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

std::uint64_t working_bytes_of_encoding_points(SampleType type, Index3 size) {
  const auto points = static_cast<std::uint64_t>(size.x * size.y * size.z);
  // Residuals of numbers of so many bits have one more, and a sign.
  const std::uint64_t events = IntegerModel::most_events(static_cast<int>(8 * size_of(type)) + 1);
  return working_bytes_of_decoding_points(size) + RansEncoder::working_bytes(points * events);
}

std::uint64_t working_bytes_of_decoding_points(Index3 size) {
  return diamond_kinds * spread_contexts * sizeof(IntegerModel) + LatticeBits::working_bytes({size.x, 1, 1});
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
