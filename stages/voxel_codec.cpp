#include "stages/voxel_codec.h"

#include <cassert>

#include "grid/sample_type.h"
#include "stages/rans_coder.h"
#include "stages/voxel_parameters.h"
#include "stages/voxel_pass.h"

namespace tagrid {
namespace {

// The first byte of a brick.
constexpr std::uint8_t constant_brick = 0, coded_brick = 1;

/// Codes all voxels in the way that the effort asks for.
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
    out.push_back(constant_brick);
    for (std::size_t byte = 0; byte < sizeof(T); ++byte)
      out.push_back(static_cast<std::uint8_t>(static_cast<std::make_unsigned_t<T>>(middle) >> (8 * byte)));
    std::fill(reconstruction.begin(), reconstruction.end(), middle);
    return;
  }
  out.push_back(coded_brick);
  VoxelParameters parameters = fit_parameters(samples, owned.size(), bounds.max_error, low, high);
  RansEncoder coder(out, samples.size() + samples.size() / 16);
  code_parameters<T>(coder, parameters);
  run_pass(effort, coder, owned, activity, bounds, parameters, samples.data(), reconstruction.data());
  coder.finish();
}

template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const Box& owned, const LatticeBits& activity,
                     const VoxelBounds& bounds, std::span<T> samples, Effort effort) {
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
  const bool whole = run_pass<T>(effort, coder, owned, activity, bounds, parameters, nullptr, samples.data());
  if (!whole || coder.exhausted()) return Status::broken("values end too soon");
  if (!coder.finished()) return Status::broken("values are followed by other bytes");
  return {};
}

#define TAGRID_INSTANTIATE(T)                                                                         \
  template void encode_voxels(std::span<const T>, const Box&, const LatticeBits&, const VoxelBounds&, \
                              std::vector<std::uint8_t>&, std::span<T>, Effort);                      \
  template Status decode_voxels(std::span<const std::uint8_t>, const Box&, const LatticeBits&,        \
                                const VoxelBounds&, std::span<T>, Effort);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
