#include "stages/values/voxels/few_brick.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "stages/sample/numbers.h"
#include "stages/values/few/find.h"
#include "stages/values/few/labels.h"
#include "stages/values/few/table.h"
#include "stages/values/voxels/constant_brick.h"

namespace tagrid {
namespace {

template <class Bounds>
FewBounds few_bounds(const Bounds& bounds) {
  const auto loose = static_cast<double>(bounds.max_error),
             surface = static_cast<double>(bounds.surface_error);
  return {loose, surface < 0 ? loose : std::min(loose, surface)};
}

/// The brick of the numbers. Those of an affine brick keep the bounds in steps; others are exact.
template <class T, class Bounds>
VoxelBrick numbers_of(const BrickOfVoxels<Bounds>& brick, FewKind kind, std::int64_t step) {
  VoxelBrick numbers{brick.owned, brick.activity, {}, brick.effort};
  if (kind != FewKind::affine) return numbers;
  const auto in_steps = [&](double bound) { return integer_bound<T>(bound) / step; };
  numbers.bounds.max_error = in_steps(static_cast<double>(brick.bounds.max_error));
  if (brick.bounds.surface_error >= 0)
    numbers.bounds.surface_error = in_steps(static_cast<double>(brick.bounds.surface_error));
  return numbers;
}

/// A sample of an affine brick. Only a broken stream has numbers beyond the type.
template <class T>
T affine_sample(T first, std::uint32_t step, std::uint16_t number) {
  return static_cast<T>(std::min<std::int64_t>(static_cast<std::int64_t>(first) + std::int64_t{step} * number,
                                               static_cast<std::int64_t>(std::numeric_limits<T>::max())));
}

template <class T>
void samples_of(const FewValues<T>& few, std::span<T> samples) {
  if (few.kind == FewKind::affine) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples[i] = affine_sample(few.first, few.step, few.numbers[i]);
    return;
  }
  const std::size_t last = few.entries.size() - 1;
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = few.entries[std::min<std::size_t>(few.numbers[i], last)];
}

std::uint64_t voxels_in(Index3 size) { return static_cast<std::uint64_t>(size.x * size.y * size.z); }

}  // namespace

template <class T, class Bounds>
std::optional<PendingFew<T>> encode_few(std::span<const T> samples, const BrickOfVoxels<Bounds>& brick, T low,
                                        T high, std::span<T> reconstruction, std::vector<std::uint8_t>& out) {
  const Index3 size = brick.owned.size();
  auto few = find_few(samples, size, few_bounds(brick.bounds), low, high);
  if (!few) return {};
  const std::size_t begin = out.size();
  out.push_back(static_cast<std::uint8_t>(few->kind));
  if constexpr (std::is_integral_v<T>)
    if (few->kind == FewKind::affine) {
      append_bytes(static_cast<std::uint64_t>(few->first), sizeof(T), out);
      append_bytes(few->step, 4, out);
    }
  if (few->kind != FewKind::affine) append_table<T>(few->entries, out);
  if (few->kind == FewKind::labels) {
    if (append_labels(few->numbers, size, static_cast<std::uint32_t>(few->entries.size()), out)) {
      samples_of(*few, reconstruction);
      return PendingFew<T>();
    }
    out.resize(begin);
    return {};
  }
  auto code = encode_as_it_is<std::uint16_t>(few->numbers, numbers_of<T>(brick, few->kind, few->step),
                                             few->numbers, out);
  samples_of(*few, reconstruction);
  if (code.is_complete()) return PendingFew<T>();
  return PendingFew<T>(std::move(code), std::move(few->numbers));
}

bool is_few_brick(std::span<const std::uint8_t> bytes) {
  return !bytes.empty() && bytes[0] >= static_cast<std::uint8_t>(FewKind::affine) &&
         bytes[0] <= static_cast<std::uint8_t>(FewKind::labels);
}

template <class T, class Bounds>
Status decode_few(std::span<const std::uint8_t> bytes, const BrickOfVoxels<Bounds>& brick,
                  std::span<T> samples, std::vector<std::uint8_t>& carried) {
  FewValues<T> few;
  few.kind = static_cast<FewKind>(bytes[0]);
  bytes = bytes.subspan(1);
  if (few.kind == FewKind::affine) {
    if constexpr (std::is_integral_v<T>) {
      if (bytes.size() < sizeof(T) + 4) return Status::broken("values end too soon");
      few.first = static_cast<T>(number_in(bytes.first(sizeof(T))));
      few.step = static_cast<std::uint32_t>(number_in(bytes.subspan(sizeof(T), 4)));
      bytes = bytes.subspan(sizeof(T) + 4);
      if (few.step < 2) return Status::broken("values with an impossible step");
    } else {
      return Status::newer("values of an unknown kind");
    }
  } else {
    const auto count = static_cast<std::size_t>(brick.owned.count());
    if (Status status = take_table(bytes, count, few.entries); !status.ok()) return status;
  }
  few.numbers.resize(samples.size());
  const Status status = few.kind == FewKind::labels
                            ? decode_labels(bytes, brick.owned.size(),
                                            static_cast<std::uint32_t>(few.entries.size()), few.numbers)
                            : decode_as_it_is<std::uint16_t>(bytes, numbers_of<T>(brick, few.kind, few.step),
                                                             few.numbers, carried);
  if (status.ok()) samples_of(few, samples);
  return status;
}

std::uint64_t working_bytes_of_numbers(SampleType type, Index3 size) {
  return bytes_of_few(voxels_in(size), size_of(type));
}

std::uint64_t working_bytes_of_encoding_few(SampleType type, Index3 size, std::uint64_t as_it_is) {
  const std::uint64_t voxels = voxels_in(size);
  const std::size_t bytes = size_of(type);
  const std::uint64_t coding =
      std::max({as_it_is, working_bytes_of_encoding_table(most_entries(voxels), bytes),
                working_bytes_of_encoding_labels(size)});
  return std::max(working_bytes_of_finding_few(voxels, bytes), bytes_of_few(voxels, bytes) + coding);
}

std::uint64_t working_bytes_of_decoding_few(SampleType type, Index3 size, std::uint64_t as_it_is) {
  return bytes_of_few(voxels_in(size), size_of(type)) +
         std::max(as_it_is, working_bytes_of_decoding_labels(size));
}

#define TAGRID_INSTANTIATE_WITH(T, Bounds)                                                                 \
  template std::optional<PendingFew<T>> encode_few(std::span<const T>, const BrickOfVoxels<Bounds>&, T, T, \
                                                   std::span<T>, std::vector<std::uint8_t>&);              \
  template Status decode_few(std::span<const std::uint8_t>, const BrickOfVoxels<Bounds>&, std::span<T>,    \
                             std::vector<std::uint8_t>&);
#define TAGRID_INSTANTIATE(T) TAGRID_INSTANTIATE_WITH(T, VoxelBounds)
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE
#define TAGRID_INSTANTIATE(T) TAGRID_INSTANTIATE_WITH(T, WideBounds)
TAGRID_FOR_EACH_WIDE_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE
#undef TAGRID_INSTANTIATE_WITH

}  // namespace tagrid
