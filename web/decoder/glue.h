// What all calls from JavaScript share. Its numbers are doubles, so sizes and places are doubles here, too: files have
// fewer than 2^53 bytes.
#pragma once

#include <emscripten.h>

#include <cstdint>

#include "tagrid/tagrid_blocks.h"

#define EXPORTED extern "C" EMSCRIPTEN_KEEPALIVE

/// A block of a brick as the plan described it, without its box.
inline tagrid_block block_of(double number, double bytes, double activity_bytes = 0) {
  tagrid_block block = {};
  block.number = static_cast<std::int64_t>(number);
  block.range.bytes = static_cast<std::uint64_t>(bytes);
  block.activity_bytes = static_cast<std::uint64_t>(activity_bytes);
  return block;
}
