// Codes the values of all voxels of one brick, each within a bound of the original, as bytes and back.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/carrying.h"
#include "stages/volume/coding_parameters.h"
#include "stages/volume/status.h"

namespace tagrid {

/// Largest absolute error of a voxel, in sample units. If surface_error >= 0, it applies to active points and
/// max_error to the others; if surface_error < 0, max_error applies to all.
struct VoxelBounds {
  std::int64_t max_error = 0;
  std::int64_t surface_error = -1;
};

/// Appends the coded values of a brick to `out`.
///   samples         of the box `owned`, x fastest; nothing outside it is read
///   activity        bits of a box that contains `owned`; ignored without a surface_error
///   reconstruction  as many values as `samples`: what decode_voxels will return
///   to_carry        bytes that the code may carry at no cost; see BytesToCarry
/// The same arguments give the same bytes on every machine.
/// REQUIRES: owned is not empty, samples.size() == owned.count().
template <class T>
Carrying encode_voxels(std::span<const T> samples, const Box& owned, const LatticeBits& activity,
                       const VoxelBounds& bounds, std::vector<std::uint8_t>& out, std::span<T> reconstruction,
                       Effort effort = Effort::normal, const BytesToCarry& to_carry = {});

/// Inverse of encode_voxels, for the same `owned`, `activity`, `bounds` and `effort`. Safe on any bytes.
/// Returns an error if they end too soon, are not used up, or could not have been written by encode_voxels;
/// otherwise samples are values of the type. After an error the content of `samples` is unspecified. Bytes that the code
/// carries are appended to `carried`. If `samples` has room for the first slices only, then only these are decoded: that takes
/// less time, what the code has after them is not checked, and nothing is appended to `carried`.
/// REQUIRES: `samples` has room for at least one slice, and for whole ones.
template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const Box& owned, const LatticeBits& activity,
                     const VoxelBounds& bounds, std::span<T> samples, Effort effort,
                     std::vector<std::uint8_t>& carried);

/// The peak of the heap that encode_voxels() takes for a box of `size` voxels, including the bytes that it
/// appends: the window, the model, and the events of noise, which is the worst case. The number of events was
/// measured: up to 4.1 for each byte of samples, for which 4.25 are counted. With Effort::best, a residual is
/// a few binary events; the number is then 8.8, for which 17 are counted.
std::uint64_t working_bytes_of_encoding_voxels(SampleType type, Index3 size, Effort effort);
/// The heap that it has while it asks for bytes to carry.
std::uint64_t working_bytes_while_voxels_ask(SampleType type, Index3 size, Effort effort);
/// The same for decode_voxels(): the window and the model.
std::uint64_t working_bytes_of_decoding_voxels(Index3 size, Effort effort);

}  // namespace tagrid
