#include "stages/voxels/codec.h"

#include <cassert>

#include "stages/entropy/rans_coder.h"
#include "stages/prediction/parameters.h"
#include "stages/volume/sample_type.h"
#include "stages/voxels/constant_brick.h"
#include "stages/voxels/pass.h"
#include "stages/wavefront/code.h"

namespace tagrid {
namespace {

// Two coders: one follows the raster order, for the best effort; for the others, the wavefront.

template <class T, class Coder>
bool run_pass(Coder& coder, const Box& owned, const LatticeBits& activity, const VoxelBounds& bounds,
              const VoxelParameters& parameters, const T* original, T* result, std::int64_t slices) {
  if (bounds.surface_error < 0)
    return VoxelPass<T, Coder, false>(coder, owned, activity, bounds, parameters)
        .run(original, result, slices);
  return VoxelPass<T, Coder, true>(coder, owned, activity, bounds, parameters).run(original, result, slices);
}

WaveBrick wave_brick(const Box& owned, const LatticeBits& activity, const VoxelBounds& bounds,
                     Effort effort) {
  const auto steps = quantizers(bounds);
  WaveBrick brick;
  brick.size = owned.size();
  brick.errors = {steps[0].error, steps[1].error};
  if (bounds.surface_error >= 0) brick.activity = &activity;
  brick.origin = owned.low;
  brick.one_distribution = effort == Effort::fast;
  return brick;
}

template <class T>
void read_row(const void* samples, std::int64_t first, std::int64_t count, std::int16_t* to) {
  const T* const from = static_cast<const T*>(samples) + first;
  for (std::int64_t x = 0; x < count; ++x) to[x] = Held<T>::from(from[x]);
}
template <class T>
void write_row(void* samples, std::int64_t first, std::int64_t count, const std::int16_t* from) {
  T* const to = static_cast<T*>(samples) + first;
  for (std::int64_t x = 0; x < count; ++x) to[x] = Held<T>::to(from[x]);
}

/// `low` and `high`: of the samples.
template <class T>
Carrying encode_coded_brick(std::span<const T> samples, const Box& owned, const LatticeBits& activity,
                            const VoxelBounds& bounds, T low, T high, std::vector<std::uint8_t>& out,
                            std::span<T> reconstruction, Effort effort, const BytesToCarry& to_carry) {
  VoxelParameters parameters = fit_parameters(samples, owned.size(), bounds.max_error, low, high);
  if (effort == Effort::best) {
    out.push_back(coded_brick);
    RansEncoder coder(out);
    code_parameters<T>(coder, parameters);
    run_pass(coder, owned, activity, bounds, parameters, samples.data(), reconstruction.data(),
             owned.size().z);
    coder.finish();
    return {};
  }
  WaveBrick brick = wave_brick(owned, activity, bounds, effort);
  brick.parameters = parameters;
  const std::size_t carried = append_wave(
      brick, {samples.data(), read_row<T>}, {reconstruction.data(), write_row<T>, owned.size().z},
      [&](RansEncoder& coder) { code_parameters<T>(coder, parameters); }, to_carry, out);
  return {to_carry != nullptr, carried};
}

}  // namespace

template <class T>
Carrying encode_voxels(std::span<const T> samples, const Box& owned, const LatticeBits& activity,
                       const VoxelBounds& bounds, std::vector<std::uint8_t>& out, std::span<T> reconstruction,
                       Effort effort, const BytesToCarry& to_carry) {
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
    append_constant_brick(middle, out);
    std::fill(reconstruction.begin(), reconstruction.end(), middle);
    return {};
  }
  const std::size_t begin = out.size();
  const Carrying carrying =
      encode_coded_brick(samples, owned, activity, bounds, low, high, out, reconstruction, effort, to_carry);
  if (out.size() - begin <= 1 + samples.size_bytes()) return carrying;
  out.resize(begin);
  append_raw_brick(samples, out);
  std::copy(samples.begin(), samples.end(), reconstruction.begin());
  return {};
}

template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const Box& owned, const LatticeBits& activity,
                     const VoxelBounds& bounds, std::span<T> samples, Effort effort,
                     std::vector<std::uint8_t>& carried) {
  const std::int64_t slices = slices_in(owned, samples.size());
  assert(bounds.surface_error < 0 || activity.box().contains(owned));
  const auto count = static_cast<std::size_t>(owned.count());
  if (!bytes.empty() && bytes[0] == raw_brick) return decode_raw_brick(bytes, count, samples);
  if (effort != Effort::best && !bytes.empty() && bytes[0] != constant_brick) {
    WaveBrick brick = wave_brick(owned, activity, bounds, effort);
    return read_wave(
        bytes, brick, {samples.data(), write_row<T>, slices},
        [&](RansDecoder& coder) { return code_parameters<T>(coder, brick.parameters); }, carried);
  }
  return decode_brick_values(bytes, count, samples, [&](RansDecoder& coder) {
    VoxelParameters parameters;
    if (!code_parameters<T>(coder, parameters)) return Status::broken("values with impossible parameters");
    if (!run_pass<T>(coder, owned, activity, bounds, parameters, nullptr, samples.data(), slices))
      return Status::broken("values end too soon");
    return Status();
  });
}

std::uint64_t working_bytes_of_encoding_voxels(SampleType type, Index3 size, Effort effort) {
  if (effort != Effort::best) return working_bytes_of_encoding_wave(type, size);
  const std::uint64_t bytes = static_cast<std::uint64_t>(size.x * size.y * size.z) * size_of(type);
  // While the models know nothing, residuals are dearer; parameters come first.
  constexpr std::uint64_t learning = 32768;
  return working_bytes_of_decoding_voxels(size, effort) + RansEncoder::working_bytes(17 * bytes + learning);
}

std::uint64_t working_bytes_while_voxels_ask(SampleType type, Index3 size, Effort effort) {
  return effort == Effort::best ? 0 : working_bytes_while_wave_asks(type, size);
}

std::uint64_t working_bytes_of_decoding_voxels(Index3 size, Effort effort) {
  if (effort != Effort::best) return working_bytes_of_decoding_wave(size);
  const auto quiet = static_cast<std::uint64_t>((size.x / segment_length + 1) * (size.y + 1));
  return quiet + BlendedWindow::working_bytes(size) + sizeof(MixedResidualModel) +
         MixedResidualModel::working_bytes();
}

#define TAGRID_INSTANTIATE(T)                                                                             \
  template Carrying encode_voxels(std::span<const T>, const Box&, const LatticeBits&, const VoxelBounds&, \
                                  std::vector<std::uint8_t>&, std::span<T>, Effort, const BytesToCarry&); \
  template Status decode_voxels(std::span<const std::uint8_t>, const Box&, const LatticeBits&,            \
                                const VoxelBounds&, std::span<T>, Effort, std::vector<std::uint8_t>&);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
