// What JavaScript calls to get the grid; see glue.h.
#include "glue.h"

#include <cstddef>
#include <cstdint>

// `box` receives six numbers, `result` where the words of the activity are, and how many.
EXPORTED int web_activity(tagrid_decoder* decoder, double number, double activity_bytes, const void* bytes,
                          std::size_t count, double* box, std::size_t* result) {
  const tagrid_block block = block_of(number, static_cast<double>(count), activity_bytes);
  tagrid_box closed = {};
  const std::uint64_t* words = nullptr;
  const int status = tagrid_decoder_activity(decoder, &block, bytes, count, &closed, &words, &result[1]);
  result[0] = reinterpret_cast<std::size_t>(words);
  for (int axis = 0; axis < 3; ++axis) {
    box[axis] = static_cast<double>(closed.low[axis]);
    box[3 + axis] = static_cast<double>(closed.high[axis]);
  }
  return status;
}

EXPORTED double web_activity_memory(const tagrid_decoder* decoder, double number, double bytes) {
  const tagrid_block block = block_of(number, bytes);
  return static_cast<double>(tagrid_decoder_activity_memory(decoder, &block));
}

// `result` receives where the edges are, four numbers of 64 bits each, and how many.
EXPORTED int web_edges(tagrid_decoder* decoder, double number, const std::uint64_t* words, std::size_t count,
                       int axis, double slice, std::size_t* result) {
  const std::int64_t* edges = nullptr;
  const int status = tagrid_decoder_edges(decoder, static_cast<std::int64_t>(number), words, count, axis,
                                          static_cast<std::int64_t>(slice), &edges, &result[1]);
  result[0] = reinterpret_cast<std::size_t>(edges);
  return status;
}
