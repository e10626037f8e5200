/* Writes the samples of a .tag file, with the half of the library that reads blocks: read_blocks FILE > SAMPLES */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

#include "tagrid/tagrid_blocks.h"

static unsigned char* file_bytes;
static size_t file_size;

static void read_file(const char* name) {
  FILE* file = fopen(name, "rb");
  if (file == NULL || fseek(file, 0, SEEK_END) != 0) exit(74);
  file_size = (size_t)ftell(file);
  file_bytes = malloc(file_size + 1);
  rewind(file);
  if (file_bytes == NULL || fread(file_bytes, 1, file_size, file) != file_size) exit(74);
  fclose(file);
}

/* Gives what the last call lacked, if it lacked something; ends the program if it failed. */
static int lacks(tagrid_blocks* blocks, tagrid_status status) {
  if (status == TAGRID_OK) return 0;
  if (status != TAGRID_NEEDS_BYTES) {
    fprintf(stderr, "%s\n", tagrid_blocks_message(blocks));
    exit(65);
  }
  const tagrid_range* ranges;
  const size_t count = tagrid_blocks_needs(blocks, &ranges);
  for (size_t i = 0; i < count; ++i)
    tagrid_blocks_give(blocks, ranges[i].offset, file_bytes + ranges[i].offset, (size_t)ranges[i].bytes);
  return 1;
}

int main(int count, char** arguments) {
  if (count != 2) return 64;
#ifdef _WIN32
  _setmode(_fileno(stdout), _O_BINARY);
#endif
  read_file(arguments[1]);
  tagrid_blocks* blocks;
  tagrid_blocks_create(file_size, &blocks);
  while (lacks(blocks, tagrid_blocks_open(blocks))) continue;
  tagrid_info info;
  tagrid_info_init(&info);
  tagrid_blocks_info(blocks, &info);
  const tagrid_box all = {{0, 0, 0}, {info.dims[0], info.dims[1], info.dims[2]}};
  size_t header_bytes;
  const void* header = tagrid_blocks_header(blocks, &header_bytes);
  tagrid_decoder* decoder;
  tagrid_decoder_open(header, header_bytes, &decoder);
  const size_t row = (size_t)info.dims[0];
  unsigned char* volume = NULL;
  size_t volume_bytes = 0, width = 0;
  tagrid_block block;
  for (int64_t number = 0;; ++number) {
    size_t found;
    while (lacks(blocks, tagrid_blocks_plan(blocks, &all, number, &block, 1, &found))) continue;
    if (found == 0) break;
    const void* samples;
    size_t bytes;
    if (tagrid_decoder_decode(decoder, &block, file_bytes + block.range.offset, (size_t)block.range.bytes,
                              &samples, &bytes) != TAGRID_OK) {
      fprintf(stderr, "%s\n", tagrid_decoder_message(decoder));
      return 65;
    }
    const int64_t* low = block.box.low;
    const size_t x = (size_t)(block.box.high[0] - low[0]), y = (size_t)(block.box.high[1] - low[1]),
                 z = (size_t)(block.box.high[2] - low[2]);
    if (volume == NULL) {
      width = bytes / (x * y * z);
      volume_bytes = row * (size_t)info.dims[1] * (size_t)info.dims[2] * width;
      volume = calloc(volume_bytes, 1);
    }
    for (size_t k = 0; k < z; ++k)
      for (size_t j = 0; j < y; ++j)
        memcpy(volume + ((((size_t)low[2] + k) * (size_t)info.dims[1] + (size_t)low[1] + j) * row +
                         (size_t)low[0]) *
                            width,
               (const unsigned char*)samples + (k * y + j) * x * width, x * width);
  }
  fwrite(volume, 1, volume_bytes, stdout);
  tagrid_decoder_close(decoder);
  tagrid_blocks_close(blocks);
  return fclose(stdout) == 0 ? 0 : 74;
}
