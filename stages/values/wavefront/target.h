// The coder of lanes for one instruction set, TAGRID_TARGET. Each has a unit of its own (coder_avx2.cpp and
// others), which can be compiled at the same time. Elsewhere one unit has all of them, by
// hwy/foreach_target.h.
#pragma once

#include <hwy/detect_targets.h>

#undef HWY_TARGET
#define HWY_TARGET TAGRID_TARGET
#include <hwy/highway.h>

#include "stages/values/wavefront/coder.h"
#include "stages/values/wavefront/decoder.h"
#include "stages/values/wavefront/encoder.h"
#include "stages/values/wavefront/states.h"

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
