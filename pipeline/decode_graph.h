// The flow graph that turns bricks back into slices.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "grid/coding_parameters.h"
#include "io/tag_file.h"

namespace tagrid {

struct DecodeStreams {
  /// Reads the next brick, or returns false after the last one; never called at the same time.
  std::function<bool(BrickBytes&)> read_brick;
  /// Takes whole slices in z order, one layer of bricks at a time; never called at the same time. Every brick
  /// of the layer has been decoded without an error before.
  std::function<void(std::span<const std::byte> samples)> write_slices;
};

/// Runs the whole decoding on `threads` threads. At most two layers of bricks are in memory. Throws
/// BrokenInput where a brick does not decode.
void run_decode_graph(const CodingParameters& parameters, int threads, const DecodeStreams& streams);

}  // namespace tagrid
