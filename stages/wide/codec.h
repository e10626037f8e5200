// Codes the values of all voxels of one brick of uint32, int32, float32 or float64, each within a bound of
// the original, as bytes and back; voxels/codec.h does the same for the narrow types.
//
// Every sample becomes a number (numbers.h): an integer is its own number; a float becomes its key if nothing
// may be lost, and otherwise a fixed-point number. If numbers span less than 2^16, the coder of narrow samples
// codes them (narrow.h); others are coded closed loop in the same way. A
// float escapes if it is not finite, or if its number would not lead back to it within its bound: its bits
// are stored.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/carrying.h"
#include "stages/volume/coding_parameters.h"
#include "stages/volume/sample_type.h"
#include "stages/volume/status.h"

namespace tagrid {

/// Largest absolute error of a voxel, in sample units; 0 keeps every bit. If surface_error >= 0, it applies
/// to active points and max_error to the others; if surface_error < 0, max_error applies to all.
struct WideBounds {
  double max_error = 0;
  double surface_error = -1;
};

/// Appends the coded values of a brick to `out`; see encode_voxels(). A sample that is not finite is restored
/// bit by bit, whatever the bound.
template <class T>
Carrying encode_wide_voxels(std::span<const T> samples, const Box& owned, const LatticeBits& activity,
                            const WideBounds& bounds, std::vector<std::uint8_t>& out,
                            std::span<T> reconstruction, Effort effort = Effort::normal,
                            const BytesToCarry& to_carry = {});

/// The inverse. Safe on any bytes: see decode_voxels().
template <class T>
Status decode_wide_voxels(std::span<const std::uint8_t> bytes, const Box& owned, const LatticeBits& activity,
                          const WideBounds& bounds, std::span<T> samples, Effort effort,
                          std::vector<std::uint8_t>& carried);

/// The peak of the heap that encode_wide_voxels() takes for a box of `size` voxels, including the bytes that
/// it appends: the numbers of the samples, and with them either the numbers in another form, or the window,
/// the models and the largest possible number of events.
std::uint64_t working_bytes_of_encoding_wide_voxels(SampleType type, Index3 size, const WideBounds& bounds,
                                                    Effort effort);
/// The same for decode_wide_voxels(): the window and the models.
std::uint64_t working_bytes_of_decoding_wide_voxels(Index3 size, Effort effort);

}  // namespace tagrid
