#include "stages/voxels/codec.h"

#include <cassert>

#include "stages/entropy/rans_coder.h"
#include "stages/prediction/parameters.h"
#include "stages/volume/sample_type.h"
#include "stages/voxels/constant_brick.h"
#include "stages/voxels/pass.h"

namespace tagrid {
namespace {

/// Codes all voxels with the method of the effort.
template <class T, class Coder>
bool run_pass(Effort effort, Coder& coder, const Box& owned, const LatticeBits& activity,
              const VoxelBounds& bounds, const VoxelParameters& parameters, const T* original, T* result) {
  const auto run = [&]<class Method>(Method) {
    if (bounds.surface_error < 0)
      return VoxelPass<T, Coder, Method, false>(coder, owned, activity, bounds, parameters)
          .run(original, result);
    return VoxelPass<T, Coder, Method, true>(coder, owned, activity, bounds, parameters)
        .run(original, result);
  };
  switch (effort) {
    case Effort::fast:
      return run(FastMethod());
    case Effort::best:
      return run(BestMethod());
    default:
      return run(NormalMethod());
  }
}

}  // namespace

template <class T>
void encode_voxels(std::span<const T> samples, const Box& owned, const LatticeBits& activity,
                   const VoxelBounds& bounds, std::vector<std::uint8_t>& out, std::span<T> reconstruction,
                   Effort effort) {
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
    return;
  }
  out.push_back(coded_brick);
  VoxelParameters parameters = fit_parameters(samples, owned.size(), bounds.max_error, low, high);
  RansEncoder coder(out);
  code_parameters<T>(coder, parameters);
  run_pass(effort, coder, owned, activity, bounds, parameters, samples.data(), reconstruction.data());
  coder.finish();
}

template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const Box& owned, const LatticeBits& activity,
                     const VoxelBounds& bounds, std::span<T> samples, Effort effort) {
  assert(!owned.empty() && static_cast<std::int64_t>(samples.size()) == owned.count());
  assert(bounds.surface_error < 0 || activity.box().contains(owned));
  return decode_brick_values(bytes, samples, [&](RansDecoder& coder) {
    VoxelParameters parameters;
    if (!code_parameters<T>(coder, parameters)) return Status::broken("values with impossible parameters");
    if (!run_pass<T>(effort, coder, owned, activity, bounds, parameters, nullptr, samples.data()))
      return Status::broken("values end too soon");
    return Status();
  });
}

std::uint64_t working_bytes_of_encoding_voxels(SampleType type, Index3 size, Effort effort) {
  const std::uint64_t bytes = static_cast<std::uint64_t>(size.x * size.y * size.z) * size_of(type),
                      events = effort == Effort::best ? 17 * bytes : 17 * bytes / 4;
  // While the models know nothing, residuals are dearer; parameters come first.
  constexpr std::uint64_t learning = 32768;
  return working_bytes_of_decoding_voxels(size, effort) + RansEncoder::working_bytes(events + learning);
}

std::uint64_t working_bytes_of_decoding_voxels(Index3 size, Effort effort) {
  const auto quiet = static_cast<std::uint64_t>((size.x / segment_length + 1) * (size.y + 1));
  switch (effort) {
    case Effort::fast:
      return quiet + VoxelWindow::working_bytes(size) + sizeof(FastResidualModel);
    case Effort::best:
      return quiet + BlendedWindow::working_bytes(size) + sizeof(MixedResidualModel) +
             MixedResidualModel::working_bytes();
    default:
      return quiet + VoxelWindow::working_bytes(size) + sizeof(ResidualModel);
  }
}

#define TAGRID_INSTANTIATE(T)                                                                         \
  template void encode_voxels(std::span<const T>, const Box&, const LatticeBits&, const VoxelBounds&, \
                              std::vector<std::uint8_t>&, std::span<T>, Effort);                      \
  template Status decode_voxels(std::span<const std::uint8_t>, const Box&, const LatticeBits&,        \
                                const VoxelBounds&, std::span<T>, Effort);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
