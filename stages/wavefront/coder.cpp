#include "stages/wavefront/coder.h"

#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/wavefront/coder.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "stages/volume/instruction_sets.h"
#include "stages/wavefront/decoder.h"
#include "stages/wavefront/encoder.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

void encode(const WaveBrick& brick, RowReader reader, RowWriter writer, const BytesToCarry& to_carry,
            WaveCode& code) {
  const bool two_bounds = brick.activity != nullptr;
  WaveBuffers buffers(brick.size, true, two_bounds, static_cast<std::int16_t>(brick.parameters.reference));
  Encoder(brick, buffers, reader, writer).run(to_carry, code);
}

bool decode(const WaveBrick& brick, const RowSet& quiet, bool single, std::span<const std::uint8_t> bits,
            std::span<const std::uint8_t> words, RowWriter writer, std::vector<std::uint8_t>* carried) {
  const bool two_bounds = brick.activity != nullptr;
  if (words.size() % 2 != 0 || words.size() < (single ? 4 : 8 * wave_lanes)) return false;
  WaveBuffers buffers(brick.size, false, two_bounds, static_cast<std::int16_t>(brick.parameters.reference));
  return Decoder(brick, buffers, writer, quiet, single, bits, words).run(carried);
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tagrid {

// Words, counts and intervals are read as halves of larger numbers.
static_assert(std::endian::native == std::endian::little);

void encode_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction,
                 const BytesToCarry& to_carry, WaveCode& code) {
  TAGRID_BEST_VERSION(encode)(brick, samples, reconstruction, to_carry, code);
}

bool decode_wave(const WaveBrick& brick, const RowSet& quiet, bool single, std::span<const std::uint8_t> bits,
                 std::span<const std::uint8_t> words, RowWriter samples, std::vector<std::uint8_t>* carried) {
  return TAGRID_BEST_VERSION(decode)(brick, quiet, single, bits, words, samples, carried);
}

}  // namespace tagrid
#endif
