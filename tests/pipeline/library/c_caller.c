/* The header as C has it: compiled as C11 without a warning, and every function is called through it. */
#include "c_caller.h"

#include <stdlib.h>
#include <string.h>
#include <tagrid/tagrid.h>
#include <tagrid/tagrid_blocks.h>

struct bytes {
  char* first;
  size_t count;
};

static int append(void* user, const void* bytes, size_t count) {
  struct bytes* to = user;
  char* larger = realloc(to->first, to->count + count);
  if (larger == NULL) return 1;
  to->first = larger;
  memcpy(to->first + to->count, bytes, count);
  to->count += count;
  return 0;
}

static int size_of_bytes(void* user, uint64_t* bytes) {
  *bytes = ((const struct bytes*)user)->count;
  return 0;
}

static int read_bytes(void* user, uint64_t offset, void* buffer, size_t count) {
  memcpy(buffer, ((const struct bytes*)user)->first + offset, count);
  return 0;
}

enum { nx = 13, ny = 11, nz = 9 };

int c_round_trip(void) {
  static int16_t samples[nx * ny * nz], again[nx * ny * nz];
  struct bytes file = {NULL, 0};
  tagrid_encode_options options;
  tagrid_encoder* encoder;
  tagrid_reader* reader = NULL;
  int right = 0, i;
  for (i = 0; i < nx * ny * nz; ++i) samples[i] = (int16_t)(i * 7 % 301);
  tagrid_encode_options_init(&options);
  options.dims[0] = nx;
  options.dims[1] = ny;
  options.dims[2] = nz;
  options.type = TAGRID_INT16;
  if (tagrid_encoder_open(&options, append, &file, NULL, &encoder) == TAGRID_OK &&
      tagrid_encoder_write(encoder, samples, nz, NULL) == TAGRID_OK &&
      tagrid_encoder_finish(encoder, NULL) == TAGRID_OK) {
    const tagrid_box box = {{0, 0, 0}, {nx, ny, nz}};
    tagrid_input input;
    tagrid_input_init(&input);
    input.user = &file;
    input.size = size_of_bytes;
    input.read_at = read_bytes;
    right = tagrid_reader_open(&input, &reader) == TAGRID_OK &&
            tagrid_reader_read(reader, &box, NULL, TAGRID_INT16, again, NULL, NULL) == TAGRID_OK &&
            memcmp(samples, again, sizeof samples) == 0;
  }
  tagrid_encoder_close(encoder);
  tagrid_reader_close(reader);
  free(file.first);
  return right;
}
