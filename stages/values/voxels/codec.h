// Codes the values of all voxels of one brick, each within a bound of the original, as bytes and back. With a
// transform, they are usually far closer: see stages/values/transform.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "stages/bound/bounds.h"
#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/status.h"
#include "stages/values/wavefront/code.h"

namespace tagrid {

/// The rest of the code of a brick. The reconstruction is complete, but the states of the coder may be
/// missing. A state begins with any 16 bits, so that the code can carry some bytes at no cost.
template <class T>
class [[nodiscard]] PendingVoxels {
 public:
  /// Nothing is missing.
  PendingVoxels() = default;
  PendingVoxels(PendingWave wave, std::span<const T> samples, std::span<T> reconstruction,
                std::vector<std::uint8_t>& out)
      : wave_(std::move(wave)), samples_(samples), reconstruction_(reconstruction), out_(&out) {}
  /// Numbers that stand for samples replace each other when they are coded. So if they are stored, the
  /// reconstruction does not change.
  PendingVoxels(PendingVoxels<std::uint16_t> of_numbers, std::vector<std::uint16_t> numbers)
      : wave_(std::move(of_numbers.wave_)), out_(of_numbers.out_), numbers_(std::move(numbers)) {}

  bool is_complete() const { return !wave_; }

  /// Appends what is missing. Returns how many bytes the code carries, the first ones of `to_carry`: 0, 2 or
  /// 64, as there is room. Returns nothing if the code was longer than the samples: then these are stored
  /// instead, and become the reconstruction. Of numbers, those that the reconstruction has are stored, and it
  /// stays. REQUIRES: it is called once, while all that encode_voxels() was given is still there.
  std::optional<std::size_t> finish(std::span<const std::uint8_t> to_carry = {});

 private:
  std::optional<PendingWave> wave_;
  std::span<const T> samples_;
  std::span<T> reconstruction_;
  std::vector<std::uint8_t>* out_ = nullptr;
  std::vector<std::uint16_t> numbers_;  ///< if they are coded instead of the samples

  template <class>
  friend class PendingVoxels;
};

/// Appends the coded values of a brick to `out`, except for what finish() appends.
///   samples         of the box brick.owned, x fastest; nothing outside it is read
///   reconstruction  as many values as `samples`: what decode_voxels will return; may be the samples
/// The same arguments give the same bytes on every machine.
/// REQUIRES: samples.size() == brick.owned.count().
template <class T>
PendingVoxels<T> encode_voxels(std::span<const T> samples, const VoxelBrick& brick,
                               std::span<T> reconstruction, std::vector<std::uint8_t>& out);

/// Inverse of encode_voxels, for the same brick. Safe on any bytes. Returns an error if they end too soon,
/// are not used up, or could not have been written by encode_voxels; otherwise samples are values of the
/// type. After an error the content of `samples` is unspecified. Bytes that the code carries are appended to
/// `carried`. If `samples` has room for the first slices only, then only these are decoded: that takes less
/// time, what the code has after them is not checked, and nothing is appended to `carried`.
/// REQUIRES: `samples` has room for at least one slice, and for complete ones.
template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const VoxelBrick& brick, std::span<T> samples,
                     std::vector<std::uint8_t>& carried);

/// The same for values that are not few: no kind of few_brick.h. Others can have these as numbers.
template <class T>
PendingVoxels<T> encode_as_it_is(std::span<const T> samples, const VoxelBrick& brick,
                                 std::span<T> reconstruction, std::vector<std::uint8_t>& out);
template <class T>
Status decode_as_it_is(std::span<const std::uint8_t> bytes, const VoxelBrick& brick, std::span<T> samples,
                       std::vector<std::uint8_t>& carried);

/// The peak of the heap that encode_voxels() takes for a box of `size` voxels, including the bytes that it
/// appends: the window, the model, and the events of noise, which is the worst case. The number of events was
/// measured: up to 4.1 for each byte of samples, for which 4.25 are counted. With Effort::best, a residual is
/// a few binary events; the number is then 8.8, for which 17 are counted. `transformed`: if there is a transform_step.
std::uint64_t working_bytes_of_encoding_voxels(SampleType type, Index3 size, Effort effort,
                                               bool transformed = false);
/// The heap that a PendingVoxels has.
std::uint64_t working_bytes_of_pending_voxels(SampleType type, Index3 size, Effort effort);
/// The same for decode_as_it_is(): the window and the model; and for decode_voxels(), which may need numbers
/// that stand for samples, too.
std::uint64_t working_bytes_of_decoding_as_it_is(Index3 size, Effort effort);
std::uint64_t working_bytes_of_decoding_voxels(SampleType type, Index3 size, Effort effort,
                                               bool transformed = false);

}  // namespace tagrid
