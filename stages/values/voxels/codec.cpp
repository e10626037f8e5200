#include "stages/values/voxels/codec.h"

#include <cassert>

#include "stages/entropy/rans_coder.h"
#include "stages/sample/sample_type.h"
#include "stages/values/best/pass.h"
#include "stages/values/prediction/parameters.h"
#include "stages/values/transform/transform.h"
#include "stages/values/voxels/constant_brick.h"
#include "stages/values/voxels/few_brick.h"
#include "stages/values/wavefront/code.h"

namespace tagrid {
namespace {

// Two coders: one follows the raster order, for the best effort; for the others, the wavefront.

template <class T, class Coder>
bool run_pass(Coder& coder, const VoxelBrick& brick, const VoxelParameters& parameters, const T* original,
              T* result, std::int64_t slices) {
  if (brick.bounds.surface_error < 0)
    return VoxelPass<T, Coder, false>(coder, brick, parameters).run(original, result, slices);
  return VoxelPass<T, Coder, true>(coder, brick, parameters).run(original, result, slices);
}

WaveBrick wave_brick(const VoxelBrick& brick) {
  const auto steps = quantizers(brick.bounds);
  WaveBrick wave;
  wave.size = brick.owned.size();
  wave.errors = {steps[0].error, steps[1].error};
  if (brick.bounds.surface_error >= 0) wave.activity = brick.activity;
  wave.origin = brick.owned.low;
  wave.one_distribution = brick.effort == Effort::fast;
  return wave;
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

/// If the code of a brick, which begins at `begin`, is longer than its samples, they replace it.
template <class T>
bool replaced_by_samples(std::span<const T> samples, std::span<T> reconstruction, std::size_t begin,
                         std::vector<std::uint8_t>& out) {
  if (out.size() - begin <= 1 + samples.size_bytes()) return false;
  out.resize(begin);
  append_raw_brick(samples, out);
  std::copy(samples.begin(), samples.end(), reconstruction.begin());
  return true;
}

template <class T>
void encode_in_raster_order(std::span<const T> samples, const VoxelBrick& brick, VoxelParameters parameters,
                            std::span<T> reconstruction, std::vector<std::uint8_t>& out) {
  const std::size_t begin = out.size();
  out.push_back(coded_brick);
  RansEncoder coder(out);
  code_parameters<T>(coder, parameters);
  run_pass(coder, brick, parameters, samples.data(), reconstruction.data(), brick.owned.size().z);
  coder.finish();
  replaced_by_samples(samples, reconstruction, begin, out);
}

template <class T>
PendingWave begin_in_lanes(std::span<const T> samples, const VoxelBrick& brick, VoxelParameters parameters,
                           std::span<T> reconstruction) {
  WaveBrick wave = wave_brick(brick);
  wave.parameters = parameters;
  return begin_wave(
      wave, {samples.data(), read_row<T>}, {reconstruction.data(), write_row<T>, brick.owned.size().z},
      [](RansEncoder& coder, VoxelParameters of_brick) { code_parameters<T>(coder, of_brick); });
}

/// `may_be_few`: whether samples may be written as numbers.
template <class T>
PendingVoxels<T> encode_narrow_voxels(std::span<const T> samples, const VoxelBrick& brick, bool may_be_few,
                                      std::span<T> reconstruction, std::vector<std::uint8_t>& out) {
  assert(!brick.owned.empty() && static_cast<std::int64_t>(samples.size()) == brick.owned.count());
  assert(reconstruction.size() == samples.size());
  assert(brick.bounds.surface_error < 0 || brick.activity->box().contains(brick.owned));
  T low = samples[0], high = samples[0];
  for (const T sample : samples) {
    low = std::min(low, sample);
    high = std::max(high, sample);
  }
  const auto steps = quantizers(brick.bounds);
  const std::int64_t error = std::min(steps[0].error, steps[1].error);
  if (std::int64_t{high} - std::int64_t{low} <= 2 * error) {
    const auto middle = static_cast<T>(low + (std::int64_t{high} - low) / 2);
    append_constant_brick(middle, out);
    std::fill(reconstruction.begin(), reconstruction.end(), middle);
    return {};
  }
  if (may_be_few)
    if (auto few = encode_few(samples, brick, low, high, reconstruction, out)) return std::move(*few);
  const VoxelParameters parameters =
      fit_parameters(samples, brick.owned.size(), brick.bounds.max_error, low, high);
  if (brick.effort == Effort::best) {
    encode_in_raster_order(samples, brick, parameters, reconstruction, out);
    return {};
  }
  return {begin_in_lanes(samples, brick, parameters, reconstruction), samples, reconstruction, out};
}

TransformBrick transform_of(const VoxelBrick& brick) {
  const double steps = brick.transform_step / least_transform_step;
  return {brick.owned.size(), static_cast<std::uint32_t>(steps), brick.bounds.max_error, brick.filter,
          brick.sums};
}

/// In a file with a transform, bricks that are not transformed are exact.
VoxelBrick exact(VoxelBrick brick) {
  if (brick.transform_step > 0) brick.bounds = {};
  return brick;
}

/// Transforms a brick, unless the values are few and then take less room, or unless that would be long.
template <class T>
PendingVoxels<T> encode_transformed(std::span<const T> samples, const VoxelBrick& brick,
                                    std::span<T> reconstruction, std::vector<std::uint8_t>& out) {
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  const std::size_t begin = out.size();
  out.push_back(transformed_brick);
  if (*low == *high || !encode_transform(samples, transform_of(brick), reconstruction, out) ||
      out.size() - begin > samples.size_bytes()) {
    out.resize(begin);
    return encode_narrow_voxels(samples, exact(brick), true, reconstruction, out);
  }
  std::vector<T> same(samples.size());
  std::vector<std::uint8_t> bytes;
  if (auto few = encode_few(samples, exact(brick), *low, *high, std::span(same), bytes)) {
    few->finish();
    if (bytes.size() < out.size() - begin) {
      out.resize(begin);
      out.insert(out.end(), bytes.begin(), bytes.end());
      std::copy(same.begin(), same.end(), reconstruction.begin());
    }
  }
  return {};
}

}  // namespace

template <class T>
std::optional<std::size_t> PendingVoxels<T>::finish(std::span<const std::uint8_t> to_carry) {
  if (is_complete()) return 0;
  const std::size_t begin = out_->size(), carried = append_wave(*std::exchange(wave_, {}), to_carry, *out_);
  const bool replaced = numbers_.empty()
                            ? replaced_by_samples(samples_, reconstruction_, begin, *out_)
                            : replaced_by_samples<std::uint16_t>(numbers_, numbers_, begin, *out_);
  if (replaced) return {};
  return carried;
}

template <class T>
PendingVoxels<T> encode_voxels(std::span<const T> samples, const VoxelBrick& brick,
                               std::span<T> reconstruction, std::vector<std::uint8_t>& out) {
  if (brick.transform_step > 0) return encode_transformed(samples, brick, reconstruction, out);
  return encode_narrow_voxels(samples, brick, true, reconstruction, out);
}

template <class T>
PendingVoxels<T> encode_as_it_is(std::span<const T> samples, const VoxelBrick& brick,
                                 std::span<T> reconstruction, std::vector<std::uint8_t>& out) {
  return encode_narrow_voxels(samples, brick, false, reconstruction, out);
}

template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const VoxelBrick& brick, std::span<T> samples,
                     std::vector<std::uint8_t>& carried) {
  if (brick.transform_step > 0 && !bytes.empty() && bytes[0] == transformed_brick)
    return decode_transform<T>(bytes.subspan(1), transform_of(brick), samples);
  if (is_few_brick(bytes)) return decode_few(bytes, exact(brick), samples, carried);
  return decode_as_it_is(bytes, exact(brick), samples, carried);
}

template <class T>
Status decode_as_it_is(std::span<const std::uint8_t> bytes, const VoxelBrick& brick, std::span<T> samples,
                       std::vector<std::uint8_t>& carried) {
  const std::int64_t slices = slices_in(brick.owned, samples.size());
  assert(brick.bounds.surface_error < 0 || brick.activity->box().contains(brick.owned));
  const auto count = static_cast<std::size_t>(brick.owned.count());
  if (!bytes.empty() && bytes[0] == raw_brick) return decode_raw_brick(bytes, count, samples);
  if (brick.effort != Effort::best && !bytes.empty() && bytes[0] != constant_brick) {
    WaveBrick wave = wave_brick(brick);
    return read_wave(
        bytes, wave, {samples.data(), write_row<T>, slices},
        [](RansDecoder& coder, VoxelParameters& of_brick) { return code_parameters<T>(coder, of_brick); },
        carried);
  }
  return decode_brick_values(bytes, count, samples, [&](RansDecoder& coder) {
    VoxelParameters parameters;
    if (!code_parameters<T>(coder, parameters)) return Status::broken("values with impossible parameters");
    if (!run_pass<T>(coder, brick, parameters, nullptr, samples.data(), slices))
      return Status::broken("values end too soon");
    return Status();
  });
}

std::uint64_t working_bytes_of_decoding_as_it_is(Index3 size, Effort effort) {
  if (effort != Effort::best) return working_bytes_of_decoding_wave(size);
  const auto quiet = static_cast<std::uint64_t>((size.x / segment_length + 1) * (size.y + 1));
  return quiet + VoxelWindow::working_bytes(size) + sizeof(MixedResidualModel) +
         MixedResidualModel::working_bytes();
}

std::uint64_t working_bytes_of_encoding_voxels(SampleType type, Index3 size, Effort effort,
                                               bool transformed) {
  const std::uint64_t bytes = static_cast<std::uint64_t>(size.x * size.y * size.z) * size_of(type);
  // New models code residuals in more bits; parameters come first.
  constexpr std::uint64_t learning = 32768;
  const std::uint64_t as_it_is = effort != Effort::best
                                     ? working_bytes_of_encoding_wave(type, size)
                                     : working_bytes_of_decoding_as_it_is(size, effort) +
                                           RansEncoder::working_bytes(17 * bytes + learning);
  const std::uint64_t exactly = working_bytes_of_encoding_few(type, size, as_it_is);
  if (!transformed) return exactly;
  // The code of the transform and a copy of the samples, while the same values are coded in another way.
  return std::max(working_bytes_of_encoding_transform(size), 2 * bytes + exactly);
}

std::uint64_t working_bytes_of_pending_voxels(SampleType type, Index3 size, Effort effort) {
  return effort == Effort::best
             ? 0
             : working_bytes_of_numbers(type, size) + working_bytes_of_pending_wave(type, size);
}

std::uint64_t working_bytes_of_decoding_voxels(SampleType type, Index3 size, Effort effort,
                                               bool transformed) {
  const std::uint64_t exactly =
      working_bytes_of_decoding_few(type, size, working_bytes_of_decoding_as_it_is(size, effort));
  return transformed ? std::max(exactly, working_bytes_of_decoding_transform(size)) : exactly;
}

#define TAGRID_INSTANTIATE(T)                                                                     \
  template class PendingVoxels<T>;                                                                \
  template PendingVoxels<T> encode_voxels(std::span<const T>, const VoxelBrick&, std::span<T>,    \
                                          std::vector<std::uint8_t>&);                            \
  template Status decode_voxels(std::span<const std::uint8_t>, const VoxelBrick&, std::span<T>,   \
                                std::vector<std::uint8_t>&);                                      \
  template PendingVoxels<T> encode_as_it_is(std::span<const T>, const VoxelBrick&, std::span<T>,  \
                                            std::vector<std::uint8_t>&);                          \
  template Status decode_as_it_is(std::span<const std::uint8_t>, const VoxelBrick&, std::span<T>, \
                                  std::vector<std::uint8_t>&);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
