// The bytes of a brick's values that are coded in lanes: parameters and quiet rows, residuals without a symbol, and what the
// states of the lanes take in.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "stages/entropy/rans_coder.h"
#include "stages/volume/sample_type.h"
#include "stages/volume/status.h"
#include "stages/wavefront/coder.h"

namespace tagrid {

/// Encodes the brick and appends its bytes. `parameters` codes those of the brick. Returns how many bytes were carried;
/// see encode_wave().
std::size_t append_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction,
                        const std::function<void(RansEncoder&)>& parameters, const BytesToCarry& to_carry,
                        std::vector<std::uint8_t>& out);

/// Decodes what append_wave() appended. Safe on any bytes. `parameters` decodes those of the brick, and returns false if the
/// encoder could not have written them. The bytes that were carried are appended to `carried`.
Status read_wave(std::span<const std::uint8_t> bytes, WaveBrick& brick, RowWriter samples,
                 const std::function<bool(RansDecoder&)>& parameters, std::vector<std::uint8_t>& carried);

/// The peak of the heap that these take for a brick of this size, with the bytes that are appended.
std::uint64_t working_bytes_of_encoding_wave(SampleType type, Index3 size);
/// While bytes to carry are asked for, the code so far included.
std::uint64_t working_bytes_while_wave_asks(SampleType type, Index3 size);
std::uint64_t working_bytes_of_decoding_wave(Index3 size);

}  // namespace tagrid
