// What JavaScript calls to decode bricks; see glue.h.
#include "glue.h"

#include <cstddef>
#include <cstdint>

EXPORTED int web_decoder_open(const void* header, std::size_t bytes, tagrid_decoder** decoder) {
  return tagrid_decoder_open(header, bytes, decoder);
}

EXPORTED void web_decoder_close(tagrid_decoder* decoder) { tagrid_decoder_close(decoder); }
EXPORTED const char* web_decoder_message(const tagrid_decoder* decoder) {
  return tagrid_decoder_message(decoder);
}

// `result` receives where the samples are, and their number of bytes.
EXPORTED int web_decode(tagrid_decoder* decoder, double number, double activity_bytes, double slices,
                        const void* bytes, std::size_t count, std::size_t* result) {
  tagrid_block block = block_of(number, static_cast<double>(count), activity_bytes);
  block.slices = static_cast<std::int64_t>(slices);
  const void* samples = nullptr;
  const int status = tagrid_decoder_decode(decoder, &block, bytes, count, &samples, &result[1]);
  result[0] = reinterpret_cast<std::size_t>(samples);
  return status;
}

EXPORTED double web_decoder_memory(const tagrid_decoder* decoder, double number, double bytes) {
  const tagrid_block block = block_of(number, bytes);
  return static_cast<double>(tagrid_decoder_memory(decoder, &block));
}
