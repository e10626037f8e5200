#include "stages/voxel_codec.h"

#include <cassert>
#include <memory>

#include "stages/prediction.h"
#include "stages/rans_coder.h"
#include "stages/residual_coding.h"
#include "stages/voxel_window.h"

namespace tagrid {
namespace {

// The first byte of a brick.
constexpr std::uint8_t constant_brick = 0, coded_brick = 1;

// A segment is a piece of a row; one decision says that all its residuals are zero.
constexpr std::int64_t segment_length = 64;

/// The quantizers of other and of active points; errors beyond the range of the type mean no more than it.
std::array<Quantizer, 2> quantizers(const VoxelBounds& bounds) {
  const auto limited = [](std::int64_t e) { return Quantizer(std::clamp<std::int64_t>(e, 0, 65535)); };
  const Quantizer other = limited(bounds.max_error);
  return {other, bounds.surface_error < 0 ? other : limited(bounds.surface_error)};
}

/// Codes every voxel. Slices go in pairs, the second one two rows behind the first, so that two rows are
/// worked on at a time whose voxels do not depend on each other: while one waits for its left neighbour, the
/// other goes on. Encoding, `original` holds the samples; `result` receives the decoded.
template <class T, class Coder>
class VoxelPass {
 public:
  VoxelPass(Coder& coder, const Box& owned, const LatticeBits& activity, const VoxelBounds& bounds,
            const VoxelParameters& parameters)
      : coder_(coder),
        owned_(owned),
        size_(owned.size()),
        activity_(activity),
        two_bounds_(bounds.surface_error >= 0),
        quantizers_(quantizers(bounds)),
        parameters_(parameters),
        window_(size_, parameters),
        model_(std::make_unique<ResidualModel>()),
        segments_((size_.x + segment_length - 1) / segment_length),
        lanes_{Lane(window_, segments_, size_.y), Lane(window_, segments_, size_.y)} {
    const std::int64_t step = std::min(quantizers_[0].step, quantizers_[1].step);
    largest_ = static_cast<std::int32_t>((parameters.high - parameters.low) / step + 1);
  }

  /// False where the decoder has run out of bytes.
  bool run(const T* original, T* result) {
    for (std::int64_t z = 0; z < size_.z; z += 2)
      for (std::int64_t turn = 0; turn < size_.y + skew; ++turn) {
        Lane* rows[2];
        std::size_t count = 0;
        if (turn < size_.y) rows[count++] = begin_row(lanes_[0], turn, z, original, result);
        if (turn >= skew && z + 1 < size_.z)
          rows[count++] = begin_row(lanes_[1], turn - skew, z + 1, original, result);
        for (std::int64_t segment = 0; segment < segments_; ++segment)
          code_segment(std::span(rows, count), segment);
        for (std::size_t i = 0; i < count; ++i) end_row(*rows[i]);
        if constexpr (!Coder::encoding)
          if (coder_.exhausted()) return false;
      }
    return true;
  }

 private:
  static constexpr std::int64_t skew = 2;  ///< a voxel has neighbours one row further in the slice before

  /// One of the two rows that are worked on.
  struct Lane {
    Lane(VoxelWindow& window, std::int64_t segments, std::int64_t rows)
        : row(window), quiet(static_cast<std::size_t>(segments * (rows + 1)), 1) {}

    VoxelRow row;
    std::int64_t y = 0, z = 0;
    const T* original = nullptr;
    T* result = nullptr;
    const std::uint64_t* bits = nullptr;  ///< activity of the row
    std::vector<std::uint8_t> quiet;      ///< by row, one more above: the latest segment had no residual
    bool is_quiet = false;                ///< the segment that is worked on
    std::array<Prediction, segment_length> predictions;
    std::array<std::int32_t, segment_length> residuals;
  };

  Lane* begin_row(Lane& lane, std::int64_t y, std::int64_t z, const T* original, T* result) {
    if (y == 0) window_.begin_slice(z);
    lane.y = y;
    lane.z = z;
    const std::int64_t offset = (z * size_.y + y) * size_.x;
    if constexpr (Coder::encoding) lane.original = original + offset;
    lane.result = result + offset;
    lane.row.begin(y, z);
    if (two_bounds_) lane.bits = activity_.row(owned_.low.y + y, owned_.low.z + z);
    return &lane;
  }

  void end_row(Lane& lane) {
    window_.end_row(lane.y, lane.z);
    for (std::int64_t x = 0; x < size_.x; ++x) lane.result[x] = Held<T>::to(lane.row.values()[x]);
  }

  const Quantizer& quantizer_at(const Lane& lane, std::int64_t x) const {
    return quantizers_[two_bounds_ && active(lane, x)];
  }
  bool active(const Lane& lane, std::int64_t x) const {
    const auto bit = static_cast<std::uint64_t>(x + owned_.low.x - activity_.box().low.x);
    return (lane.bits[bit / 64] >> (bit % 64)) & 1;
  }

  std::int32_t decoded(const Prediction& p, std::int64_t residual, const Quantizer& quantizer) const {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(p.value + residual * quantizer.step, parameters_.low, parameters_.high));
  }

  void code_segment(std::span<Lane*> rows, std::int64_t segment) {
    const std::int64_t first = segment * segment_length, last = std::min(size_.x, first + segment_length);
    Lane* live[2];  // those whose voxels have to be looked at
    std::size_t count = 0;
    for (Lane* lane : rows) {
      const bool flat = lane->row.is_flat(first, last);
      if constexpr (Coder::encoding) {
        if (flat && repeats(*lane, first, last))
          lane->row.fill(first, last);
        else
          live[count++] = lane;
      } else {
        lane->is_quiet = code_quiet(*lane, segment, false);
        if (flat && lane->is_quiet)
          lane->row.fill(first, last);
        else
          live[count++] = lane;
      }
    }
    for (std::size_t i = 0; i < count; ++i) live[i]->row.prepare();
    if constexpr (Coder::encoding) {
      for (Lane* lane : rows) lane->is_quiet = true;
      if (count == 2) quantize<2>(live, first, last);
      if (count == 1) quantize<1>(live, first, last);
      for (Lane* lane : rows) code_quiet(*lane, segment, lane->is_quiet);
      for (std::int64_t x = first; x < last; ++x)
        for (std::size_t i = 0; i < count; ++i) {
          if (live[i]->is_quiet) continue;
          const auto at = static_cast<std::size_t>(x - first);
          code(*live[i], x, live[i]->predictions[at], live[i]->residuals[at]);
        }
    } else {
      if (count == 2) decode<2>(live, first, last);
      if (count == 1) decode<1>(live, first, last);
    }
  }

  bool code_quiet(Lane& lane, std::int64_t segment, bool is_quiet) {
    const auto at = static_cast<std::size_t>((lane.y + 1) * segments_ + segment);
    const int around = lanes_[(&lane == &lanes_[0])].quiet[at] |
                       lane.quiet[at - static_cast<std::size_t>(segments_)] << 1 |
                       (segment > 0 ? lane.quiet[at - 1] : 1) << 2;
    is_quiet = code_adaptive(coder_, is_quiet, quiet_[static_cast<std::size_t>(around)], 250);
    lane.quiet[at] = is_quiet;
    return is_quiet;
  }

  /// True if all samples of the segment are within the bound of the value on its left.
  bool repeats(const Lane& lane, std::int64_t first, std::int64_t last) const {
    const std::int32_t left = lane.row.values()[first - 1];
    const auto bound = static_cast<std::int32_t>(std::min(quantizers_[0].error, quantizers_[1].error));
    bool all = true;
    for (std::int64_t x = first; x < last; ++x)
      all &= std::abs(Held<T>::from(lane.original[x]) - left) <= bound;
    return all;
  }

  // What is quantized does not depend on how it is coded: the whole segment is quantized before its first
  // decision is coded.
  template <std::size_t n>
  void quantize(Lane** lanes, std::int64_t first, std::int64_t last) {
    for (std::int64_t x = first; x < last; ++x) {
      const auto at = static_cast<std::size_t>(x - first);
      for (std::size_t i = 0; i < n; ++i) lanes[i]->predictions[at] = lanes[i]->row.predict(x, biases_);
      for (std::size_t i = 0; i < n; ++i) {
        Lane& lane = *lanes[i];
        const Quantizer& quantizer = quantizer_at(lane, x);
        const Prediction& p = lane.predictions[at];
        const std::int32_t residual = quantizer(Held<T>::from(lane.original[x]) - p.value);
        lane.residuals[at] = residual;
        lane.is_quiet = lane.is_quiet && residual == 0;
        lane.row.commit(x, p, decoded(p, residual, quantizer), residual, quantizer.step, biases_);
      }
    }
  }

  template <std::size_t n>
  void decode(Lane** lanes, std::int64_t first, std::int64_t last) {
    for (std::int64_t x = first; x < last; ++x) {
      std::array<Prediction, n> p;
      std::array<std::int32_t, n> residual{};
      for (std::size_t i = 0; i < n; ++i) p[i] = lanes[i]->row.predict(x, biases_);
      for (std::size_t i = 0; i < n; ++i)
        if (!lanes[i]->is_quiet) residual[i] = code(*lanes[i], x, p[i], 0);
      for (std::size_t i = 0; i < n; ++i) {
        const Quantizer& quantizer = quantizer_at(*lanes[i], x);
        lanes[i]->row.commit(x, p[i], decoded(p[i], residual[i], quantizer), residual[i], quantizer.step,
                             biases_);
      }
    }
  }

  std::int32_t code(const Lane& lane, std::int64_t x, const Prediction& p, std::int32_t residual) {
    return p.flat ? model_->code_flat(coder_, residual, largest_)
                  : model_->code(coder_, residual, largest_, lane.row.context(x, p, quantizer_at(lane, x)));
  }

  Coder& coder_;
  const Box& owned_;
  Index3 size_;
  const LatticeBits& activity_;
  bool two_bounds_;
  std::array<Quantizer, 2> quantizers_;
  const VoxelParameters& parameters_;
  VoxelWindow window_;
  std::unique_ptr<ResidualModel> model_;
  Biases biases_{};
  std::int64_t segments_;
  std::int32_t largest_;
  std::array<AdaptiveBit, 8> quiet_{};
  std::array<Lane, 2> lanes_;
};

template <class Coder>
void code_weights(Coder& coder, IntegerModel& model, Weights& weights, int count) {
  const Weights origin = default_weights();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    weights.of_tap[i] = static_cast<std::int32_t>(
        origin.of_tap[i] +
        std::clamp<std::int64_t>(model.code_signed(coder, weights.of_tap[i] - origin.of_tap[i]),
                                 -4 * weight_limit, 4 * weight_limit));
}

/// The parameters, before the first voxel. False where they could not have been written by the encoder.
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

template <class T>
VoxelParameters fit_parameters(std::span<const T> samples, Index3 size, const VoxelBounds& bounds, T low,
                               T high) {
  VoxelParameters parameters;
  std::int64_t total = 0;
  for (const T sample : samples) total += sample;
  const auto mean = static_cast<T>(total / static_cast<std::int64_t>(samples.size()));
  parameters.low = Held<T>::from(low);
  parameters.high = Held<T>::from(high);
  parameters.reference = Held<T>::from(mean);
  const double error = static_cast<double>(std::min<std::int64_t>(bounds.max_error, 65535));
  const double noise = error * (error + 1) / 3;
  parameters.first_slice = fit_weights(samples, size, slice_taps, std::int64_t{mean}, noise);
  parameters.others =
      size.z > 1 ? fit_weights(samples, size, all_taps, std::int64_t{mean}, noise) : default_weights();
  return parameters;
}

}  // namespace

template <class T>
void encode_voxels(std::span<const T> samples, const Box& owned, const LatticeBits& activity,
                   const VoxelBounds& bounds, std::vector<std::uint8_t>& out, std::span<T> reconstruction) {
  assert(!owned.empty() && static_cast<std::int64_t>(samples.size()) == owned.count());
  assert(reconstruction.size() == samples.size());
  assert(bounds.surface_error < 0 || activity.box().contains(owned));
  T low = samples[0], high = samples[0];
  for (const T sample : samples) {
    low = std::min(low, sample);
    high = std::max(high, sample);
  }
  const auto steps = quantizers(bounds);
  const std::int64_t error = std::min(steps[0].error, steps[1].error);
  if (std::int64_t{high} - std::int64_t{low} <= 2 * error) {
    const auto middle = static_cast<T>(low + (std::int64_t{high} - low) / 2);
    out.push_back(constant_brick);
    for (std::size_t byte = 0; byte < sizeof(T); ++byte)
      out.push_back(static_cast<std::uint8_t>(static_cast<std::make_unsigned_t<T>>(middle) >> (8 * byte)));
    std::fill(reconstruction.begin(), reconstruction.end(), middle);
    return;
  }
  out.push_back(coded_brick);
  VoxelParameters parameters = fit_parameters(samples, owned.size(), bounds, low, high);
  RansEncoder coder(out, samples.size() + samples.size() / 16);
  code_parameters<T>(coder, parameters);
  VoxelPass<T, RansEncoder> pass(coder, owned, activity, bounds, parameters);
  pass.run(samples.data(), reconstruction.data());
  coder.finish();
}

template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const Box& owned, const LatticeBits& activity,
                     const VoxelBounds& bounds, std::span<T> samples) {
  assert(!owned.empty() && static_cast<std::int64_t>(samples.size()) == owned.count());
  assert(bounds.surface_error < 0 || activity.box().contains(owned));
  if (bytes.empty()) return Status::broken("values are missing");
  if (bytes[0] == constant_brick) {
    if (bytes.size() != 1 + sizeof(T))
      return Status::broken("values of a constant brick have the wrong size");
    std::make_unsigned_t<T> value = 0;
    for (std::size_t byte = 0; byte < sizeof(T); ++byte)
      value = static_cast<std::make_unsigned_t<T>>(value | bytes[1 + byte] << (8 * byte));
    std::fill(samples.begin(), samples.end(), static_cast<T>(value));
    return {};
  }
  if (bytes[0] != coded_brick) return Status::broken("values of an unknown kind");
  RansDecoder coder(bytes.subspan(1));
  VoxelParameters parameters;
  if (!code_parameters<T>(coder, parameters)) return Status::broken("values with impossible parameters");
  VoxelPass<T, RansDecoder> pass(coder, owned, activity, bounds, parameters);
  if (!pass.run(nullptr, samples.data()) || coder.exhausted()) return Status::broken("values end too soon");
  if (!coder.finished()) return Status::broken("values are followed by other bytes");
  return {};
}

#define TAGRID_INSTANTIATE(T)                                                                         \
  template void encode_voxels(std::span<const T>, const Box&, const LatticeBits&, const VoxelBounds&, \
                              std::vector<std::uint8_t>&, std::span<T>);                              \
  template Status decode_voxels(std::span<const std::uint8_t>, const Box&, const LatticeBits&,        \
                                const VoxelBounds&, std::span<T>);
TAGRID_INSTANTIATE(std::uint8_t)
TAGRID_INSTANTIATE(std::int8_t)
TAGRID_INSTANTIATE(std::uint16_t)
TAGRID_INSTANTIATE(std::int16_t)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
