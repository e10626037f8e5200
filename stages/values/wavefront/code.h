// The bytes of a brick's values that are coded in lanes: parameters and quiet rows, residuals without a
// symbol, and what the states of the lanes take in.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/entropy/rans_coder.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/status.h"
#include "stages/values/wavefront/coder.h"

namespace tagrid {

/// The code of a brick, of which only the states of the lanes are missing.
struct PendingWave {
  std::vector<std::uint8_t> head;  ///< parameters and quiet rows
  WaveSymbols symbols;
};

/// Encodes the brick; then its reconstruction is complete. `code_parameters` codes those of the brick.
PendingWave begin_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction,
                       void (*code_parameters)(RansEncoder&, VoxelParameters));

/// Appends the bytes of the brick, whose states carry the first bytes of `to_carry`. Returns how many: none
/// if there are fewer than the states have room for.
std::size_t append_wave(PendingWave wave, std::span<const std::uint8_t> to_carry,
                        std::vector<std::uint8_t>& out);

/// Decodes what append_wave() appended. Safe on any bytes. `decode_parameters` decodes those of the brick, and
/// returns false if the encoder could not have written them. The bytes that were carried are appended to
/// `carried`.
Status read_wave(std::span<const std::uint8_t> bytes, WaveBrick& brick, RowWriter samples,
                 bool (*decode_parameters)(RansDecoder&, VoxelParameters&),
                 std::vector<std::uint8_t>& carried);

/// The peak of the heap that these take for a brick of this size, with the bytes that are appended.
std::uint64_t working_bytes_of_encoding_wave(SampleType type, Index3 size);
/// What a PendingWave takes.
std::uint64_t working_bytes_of_pending_wave(SampleType type, Index3 size);
std::uint64_t working_bytes_of_decoding_wave(Index3 size);

}  // namespace tagrid
