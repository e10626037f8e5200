#include "stages/voxel_codec.h"

#include <cassert>
#include <memory>

#include "grid/sample_type.h"
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

/// Codes every voxel in raster order. Encoding, `original` holds the samples; `result` receives the decoded.
template <class T, class Coder>
class VoxelPass {
 public:
  VoxelPass(Coder& coder, const Box& owned, const LatticeBits& activity, const VoxelBounds& bounds,
            const VoxelParameters& parameters)
      : coder_(coder),
        owned_(owned),
        activity_(activity),
        two_bounds_(bounds.surface_error >= 0),
        quantizers_(quantizers(bounds)),
        parameters_(parameters),
        window_(owned.size(), parameters),
        model_(std::make_unique<ResidualModel>()),
        segments_((owned.size().x + segment_length - 1) / segment_length),
        quiet_before_(static_cast<std::size_t>(segments_ * (owned.size().y + 1)), 1) {
    const std::int64_t step = std::min(quantizers_[0].step, quantizers_[1].step);
    largest_ = static_cast<std::int32_t>((parameters.high - parameters.low) / step + 1);
  }

  /// False where the decoder has run out of bytes.
  bool run(const T* original, T* result) {
    const Index3 size = owned_.size();
    for (std::int64_t z = 0; z < size.z; ++z) {
      window_.begin_slice(z);
      for (std::int64_t y = 0; y < size.y; ++y, result += size.x, original += Coder::encoding ? size.x : 0) {
        window_.begin_row(y);
        if (two_bounds_) bits_ = activity_.row(owned_.low.y + y, owned_.low.z + z);
        for (std::int64_t s = 0; s < segments_; ++s) {
          const std::int64_t first = s * segment_length, last = std::min(size.x, first + segment_length);
          // Of the same segment: in the slice before, until it is replaced, and in the row above; and the one
          // on the left.
          std::uint8_t* quiet = &quiet_before_[static_cast<std::size_t>((y + 1) * segments_ + s)];
          AdaptiveBit& model = quiet_[*quiet | quiet[-segments_] << 1 | (s > 0 ? quiet[-1] : 1) << 2];
          if constexpr (Coder::encoding)
            *quiet = encode_segment(original, first, last, model);
          else
            *quiet = decode_segment(first, last, model);
        }
        window_.end_row();
        for (std::int64_t x = 0; x < size.x; ++x) result[x] = Held<T>::to(window_.row()[x]);
        if constexpr (!Coder::encoding)
          if (coder_.exhausted()) return false;
      }
    }
    return true;
  }

 private:
  const Quantizer& quantizer_at(std::int64_t x) const { return quantizers_[two_bounds_ && active(x)]; }
  bool active(std::int64_t x) const {
    const auto bit = static_cast<std::uint64_t>(x + owned_.low.x - activity_.box().low.x);
    return (bits_[bit / 64] >> (bit % 64)) & 1;
  }

  std::int32_t decoded(const Prediction& p, std::int64_t residual, const Quantizer& quantizer) const {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(p.value + residual * quantizer.step, parameters_.low, parameters_.high));
  }

  // What is quantized does not depend on how it is coded: the whole segment is quantized before its first
  // decision is coded.
  bool encode_segment(const T* original, std::int64_t first, std::int64_t last, AdaptiveBit& quiet_model) {
    if (window_.is_flat(first, last) && repeats(original, first, last)) {
      window_.fill(first, last);
      return code_adaptive(coder_, true, quiet_model, 250);
    }
    window_.prepare();
    std::int32_t any = 0;
    for (std::int64_t x = first; x < last; ++x) {
      const auto i = static_cast<std::size_t>(x - first);
      const Quantizer& quantizer = quantizer_at(x);
      const Prediction p = window_.predict(x);
      const std::int32_t residual = quantizer(Held<T>::from(original[x]) - p.value);
      predictions_[i] = p;
      residuals_[i] = residual;
      any |= residual;
      window_.commit(x, p, decoded(p, residual, quantizer), residual, quantizer.step);
    }
    if (code_adaptive(coder_, any == 0, quiet_model, 250)) return true;
    for (std::int64_t x = first; x < last; ++x)
      code(x, predictions_[static_cast<std::size_t>(x - first)],
           residuals_[static_cast<std::size_t>(x - first)]);
    return false;
  }

  /// True if all samples of the segment are within the bound of the value on its left.
  bool repeats(const T* original, std::int64_t first, std::int64_t last) const {
    const std::int32_t left = window_.row()[first - 1];
    const auto bound = static_cast<std::int32_t>(std::min(quantizers_[0].error, quantizers_[1].error));
    bool all = true;
    for (std::int64_t x = first; x < last; ++x) all &= std::abs(Held<T>::from(original[x]) - left) <= bound;
    return all;
  }

  bool decode_segment(std::int64_t first, std::int64_t last, AdaptiveBit& quiet_model) {
    const bool quiet = code_adaptive(coder_, false, quiet_model, 250);
    if (quiet && window_.is_flat(first, last)) {
      window_.fill(first, last);
      return true;
    }
    window_.prepare();
    for (std::int64_t x = first; x < last; ++x) {
      const Quantizer& quantizer = quantizer_at(x);
      const Prediction p = window_.predict(x);
      const std::int32_t residual = quiet ? 0 : code(x, p, 0);
      window_.commit(x, p, decoded(p, residual, quantizer), residual, quantizer.step);
    }
    return quiet;
  }

  std::int32_t code(std::int64_t x, const Prediction& p, std::int32_t residual) {
    return p.flat ? model_->code_flat(coder_, residual, largest_)
                  : model_->code(coder_, residual, largest_, window_.context(x, p, quantizer_at(x)));
  }

  Coder& coder_;
  const Box& owned_;
  const LatticeBits& activity_;
  bool two_bounds_;
  std::array<Quantizer, 2> quantizers_;
  const VoxelParameters& parameters_;
  VoxelWindow window_;
  std::unique_ptr<ResidualModel> model_;
  std::int64_t segments_;
  std::int32_t largest_;
  std::vector<std::uint8_t> quiet_before_;  ///< by row, one more above: the latest segment had no residual
  std::array<AdaptiveBit, 8> quiet_{};
  const std::uint64_t* bits_ = nullptr;
  std::array<Prediction, segment_length> predictions_;
  std::array<std::int32_t, segment_length> residuals_;
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
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
