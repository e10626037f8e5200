// The loop over the voxels of one brick, the same for encoding and decoding and for every effort.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "stages/blended_window.h"
#include "stages/mixed_residual_model.h"
#include "stages/residual_coding.h"
#include "stages/voxel_codec.h"
#include "stages/voxel_window.h"

namespace tagrid {

// A segment is a piece of a row; one decision says that all its residuals are zero.
inline constexpr std::int64_t segment_length = 64;

/// The quantizers of other and of active points; errors beyond the range of the type mean no more than it.
inline std::array<Quantizer, 2> quantizers(const VoxelBounds& bounds) {
  const auto limited = [](std::int64_t e) { return Quantizer(std::clamp<std::int64_t>(e, 0, 65535)); };
  const Quantizer other = limited(bounds.max_error);
  return {other, bounds.surface_error < 0 ? other : limited(bounds.surface_error)};
}

/// What an effort is: how a voxel is predicted, and how its residual is coded.
struct NormalMethod {
  using Window = VoxelWindow;
  using Model = ResidualModel;
};
struct FastMethod {
  using Window = VoxelWindow;
  using Model = FastResidualModel;
};
struct BestMethod {
  using Window = BlendedWindow;
  using Model = MixedResidualModel;
};

/// Codes every voxel in raster order. Encoding, `original` holds the samples; `result` receives the decoded.
template <class T, class Coder, class Method>
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
        window_(owned.size(), parameters, std::min(quantizers_[0].error, quantizers_[1].error)),
        model_(std::make_unique<typename Method::Model>()),
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
  using Prediction = typename Method::Window::Prediction;

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
  typename Method::Window window_;
  std::unique_ptr<typename Method::Model> model_;
  std::int64_t segments_;
  std::int32_t largest_;
  std::vector<std::uint8_t> quiet_before_;  ///< by row, one more above: the latest segment had no residual
  std::array<AdaptiveBit, 8> quiet_{};
  const std::uint64_t* bits_ = nullptr;
  std::array<Prediction, segment_length> predictions_;
  std::array<std::int32_t, segment_length> residuals_;
};

}  // namespace tagrid
