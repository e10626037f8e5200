// The loop over the voxels of one brick, the same for encoding and decoding.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <type_traits>
#include <vector>

#include "stages/bound/bounds.h"
#include "stages/values/best/residual_model.h"
#include "stages/values/best/window.h"

namespace tagrid {

// A segment is a piece of a row; one event can code that all its residuals are zero.
inline constexpr std::int64_t segment_length = 64;

/// Codes every voxel in raster order. When encoding, `original` holds the samples; `result` receives the
/// decoded ones. `two_bounds`: active points have a bound of their own.
template <class T, class Coder, bool two_bounds>
class VoxelPass {
 public:
  VoxelPass(Coder& coder, const VoxelBrick& brick, const VoxelParameters& parameters)
      : coder_(coder),
        owned_(brick.owned),
        activity_(brick.activity),
        quantizers_(quantizers(brick.bounds)),
        low_(parameters.low),
        high_(parameters.high),
        window_(owned_.size(), parameters, std::min(quantizers_[0].error, quantizers_[1].error)),
        model_(std::make_unique<MixedResidualModel>()),
        segments_((owned_.size().x + segment_length - 1) / segment_length),
        quiet_before_(static_cast<std::size_t>(segments_ * (owned_.size().y + 1)), 1) {
    const std::int64_t step = std::min(quantizers_[0].step, quantizers_[1].step);
    largest_ = static_cast<std::int32_t>((parameters.high - parameters.low) / step + 1);
  }

  /// Codes the first `slices` slices. Returns false if the decoder has run out of bytes.
  bool run(const T* original, T* result, std::int64_t slices) {
    const Index3 size = owned_.size();
    for (std::int64_t z = 0; z < slices; ++z) {
      window_.begin_slice(z);
      for (std::int64_t y = 0; y < size.y; ++y, result += size.x, original += Coder::encoding ? size.x : 0) {
        window_.begin_row(y);
        if constexpr (two_bounds) bits_ = activity_->row(owned_.low.y + y, owned_.low.z + z);
        for (std::int64_t s = 0; s < segments_; ++s) {
          const std::int64_t first = s * segment_length, last = std::min(size.x, first + segment_length);
          // Whether neighboring segments were quiet: the same one in the slice before (until it is replaced)
          // and in the row above, and the one on the left.
          std::uint8_t* quiet = &quiet_before_[static_cast<std::size_t>((y + 1) * segments_ + s)];
          AdaptiveBit& model = quiet_[*quiet | quiet[-segments_] << 1 | (s > 0 ? quiet[-1] : 1) << 2];
          if constexpr (Coder::encoding)
            *quiet = encode_segment(original, first, last, model);
          else
            *quiet = decode_segment(first, last, model);
        }
        window_.end_row();
        for (std::int64_t x = 0; x < size.x; ++x) result[x] = Held<T>::to(window_.row()[x]);
        if (coder_.exhausted()) return false;
      }
    }
    return true;
  }

 private:
  using Prediction = VoxelWindow::Prediction;
  using Context = VoxelWindow::Context;
  /// How a residual is coded: flat if the neighbors are all equal, otherwise in a context.
  struct CodedBy {
    bool flat;
    Context context;
  };

  [[gnu::always_inline]] CodedBy coded_by(std::int64_t x, const LeftVoxels& left, const Prediction& p,
                                          const Quantizer& quantizer) const {
    if (p.flat) return {true, {}};
    return {false, window_.context(x, left, p, quantizer)};
  }

  const Quantizer& quantizer_at(std::int64_t x) const {
    if constexpr (two_bounds) return quantizers_[active(x)];
    return quantizers_[0];
  }
  bool active(std::int64_t x) const {
    const auto bit = static_cast<std::uint64_t>(x + owned_.low.x - activity_->box().low.x);
    return (bits_[bit / 64] >> (bit % 64)) & 1;
  }

  std::int32_t decoded(const Prediction& p, std::int32_t residual, const Quantizer& quantizer) const {
    // With one bound, a residual times its step is little larger than the range. With two, a damaged residual
    // is limited by the smaller step, but may be multiplied by the larger one.
    using Product = std::conditional_t<two_bounds, std::int64_t, std::int32_t>;
    return static_cast<std::int32_t>(
        std::clamp<Product>(p.value + residual * static_cast<Product>(quantizer.step), low_, high_));
  }

  // Quantization does not depend on the coding, so the segment is quantized before its first event is coded.
  bool encode_segment(const T* original, std::int64_t first, std::int64_t last, AdaptiveBit& quiet_model) {
    if (window_.is_flat(first, last) && repeats(original, first, last)) {
      window_.fill(first, last);
      return code_adaptive(coder_, true, quiet_model, 250);
    }
    window_.prepare();
    LeftVoxels left = window_.left_of(first);
    std::int32_t any = 0;
    for (std::int64_t x = first; x < last; ++x) {
      const auto i = static_cast<std::size_t>(x - first);
      const Quantizer& quantizer = quantizer_at(x);
      const Prediction p = window_.predict(x, left);
      const std::int32_t residual = quantizer(Held<T>::from(original[x]) - p.value);
      coded_by_[i] = coded_by(x, left, p, quantizer);
      residuals_[i] = residual;
      any |= residual;
      window_.commit(x, left, p, decoded(p, residual, quantizer), residual, quantizer.step);
    }
    if (code_adaptive(coder_, any == 0, quiet_model, 250)) return true;
    for (std::size_t i = 0; i < static_cast<std::size_t>(last - first); ++i)
      code(coded_by_[i], residuals_[i]);
    return false;
  }

  /// True if all samples of the segment are within the bound of the value to its left.
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
    if (quiet)
      decode_each(first, last, [](auto&&...) { return 0; });
    else
      decode_each(first, last, [this](const auto&... of) { return code(coded_by(of...), 0); });
    return quiet;
  }

  template <class F>
  [[gnu::always_inline]] void decode_each(std::int64_t first, std::int64_t last, F&& residual_of) {
    LeftVoxels left = window_.left_of(first);
    for (std::int64_t x = first; x < last; ++x) {
      const Quantizer& quantizer = quantizer_at(x);
      const Prediction p = window_.predict(x, left);
      const std::int32_t residual = residual_of(x, left, p, quantizer);
      window_.commit(x, left, p, decoded(p, residual, quantizer), residual, quantizer.step);
    }
  }

  [[gnu::always_inline]] std::int32_t code(const CodedBy& s, std::int32_t residual) {
    return s.flat ? model_->code_flat(coder_, residual, largest_)
                  : model_->code(coder_, residual, largest_, s.context);
  }

  Coder& coder_;
  Box owned_;
  const LatticeBits* activity_;
  std::array<Quantizer, 2> quantizers_;
  std::int32_t low_, high_;  ///< range of the originals
  VoxelWindow window_;
  std::unique_ptr<MixedResidualModel> model_;
  std::int64_t segments_;
  std::int32_t largest_;
  std::vector<std::uint8_t> quiet_before_;  ///< whether a segment has no residual; one more row above
  std::array<AdaptiveBit, 8> quiet_{};
  const std::uint64_t* bits_ = nullptr;
  std::array<CodedBy, segment_length> coded_by_;
  std::array<std::int32_t, segment_length> residuals_;
};

}  // namespace tagrid
