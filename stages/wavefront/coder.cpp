#include "stages/wavefront/coder.h"

#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/wavefront/coder.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "stages/volume/instruction_sets.h"
#include "stages/wavefront/decoder.h"
#include "stages/wavefront/encoder.h"
#include "stages/wavefront/states.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

void encode(const WaveBrick& brick, RowReader reader, RowWriter writer, WaveSymbols& symbols) {
  Encoder(brick, symbols, reader, writer).run();
}

WaveCode push(WaveSymbols& symbols, std::span<const std::uint8_t> to_carry) {
  return States(symbols).run(to_carry);
}

bool decode(const WaveBrick& brick, const WaveBytes& code, RowWriter writer,
            std::vector<std::uint8_t>& carried) {
  const bool two_bounds = brick.activity != nullptr;
  if (code.words.size() % 2 != 0 || code.words.size() < (code.single ? 4 : 8 * wave_lanes)) return false;
  WaveBuffers buffers(brick.size, false, two_bounds, static_cast<std::int16_t>(brick.parameters.reference));
  return Decoder(brick, buffers, code, writer).run(carried);
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tagrid {

// Words, counts and intervals are read as halves of larger numbers.
static_assert(std::endian::native == std::endian::little);

WaveSymbols::WaveSymbols(const WaveBrick& brick)
    : buffers(brick.size, true, brick.activity != nullptr,
              static_cast<std::int16_t>(brick.parameters.reference)) {}

WaveSymbols encode_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction) {
  WaveSymbols symbols(brick);
  TAGRID_BEST_VERSION(encode)(brick, samples, reconstruction, symbols);
  return symbols;
}

WaveCode push_symbols(WaveSymbols& symbols, std::span<const std::uint8_t> to_carry) {
  return TAGRID_BEST_VERSION(push)(symbols, to_carry);
}

bool decode_wave(const WaveBrick& brick, const WaveBytes& code, RowWriter samples,
                 std::vector<std::uint8_t>& carried) {
  return TAGRID_BEST_VERSION(decode)(brick, code, samples, carried);
}

}  // namespace tagrid
#endif
