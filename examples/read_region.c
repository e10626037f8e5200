/* Reads a box of samples of a .tag file, and prints their mean.
 *
 *     read_region scan.tag 100 100 40  164 164 104
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <tagrid/tagrid.h>

/* A sample of any type as a number. */
static double sample_at(const void* samples, tagrid_type type, size_t i) {
  switch (type) {
    case TAGRID_UINT8: return ((const uint8_t*)samples)[i];
    case TAGRID_INT8: return ((const int8_t*)samples)[i];
    case TAGRID_UINT16: return ((const uint16_t*)samples)[i];
    case TAGRID_INT16: return ((const int16_t*)samples)[i];
    case TAGRID_UINT32: return ((const uint32_t*)samples)[i];
    case TAGRID_INT32: return ((const int32_t*)samples)[i];
    case TAGRID_FLOAT32: return ((const float*)samples)[i];
    case TAGRID_FLOAT64: return ((const double*)samples)[i];
  }
  return 0;
}

/* Ends the program with the message of the reader. */
static int fail(tagrid_reader* reader, tagrid_status status, void* samples) {
  fprintf(stderr, "%s: %s\n", tagrid_status_text(status), tagrid_reader_message(reader));
  free(samples);
  tagrid_reader_close(reader);
  return 1;
}

int main(int argc, char** argv) {
  tagrid_reader* reader = NULL;
  tagrid_info info;
  tagrid_status status;
  tagrid_box box;
  tagrid_call call;
  void* samples;
  double sum = 0;
  size_t count = 1, i;
  int axis;

  if (argc != 8) {
    fprintf(stderr, "usage: read_region FILE LOW_X LOW_Y LOW_Z HIGH_X HIGH_Y HIGH_Z\n");
    return 2;
  }
  for (axis = 0; axis < 3; ++axis) {
    box.low[axis] = strtoll(argv[2 + axis], NULL, 10);
    box.high[axis] = strtoll(argv[5 + axis], NULL, 10);
  }

  /* The reader has a message even if it could not be opened. */
  status = tagrid_reader_open_file(argv[1], &reader);
  if (status != TAGRID_OK) return fail(reader, status, NULL);
  tagrid_info_init(&info);
  status = tagrid_reader_info(reader, &info);
  if (status != TAGRID_OK) return fail(reader, status, NULL);

  /* The library checks the box, too, but memory is allocated before that. */
  for (axis = 0; axis < 3; ++axis) {
    if (box.low[axis] < 0 || box.low[axis] >= box.high[axis] || box.high[axis] > info.dims[axis]) {
      fprintf(stderr, "the volume has %" PRId64 " x %" PRId64 " x %" PRId64 " samples\n", info.dims[0],
              info.dims[1], info.dims[2]);
      tagrid_reader_close(reader);
      return 1;
    }
    count *= (size_t)(box.high[axis] - box.low[axis]);
  }
  samples = malloc(count * tagrid_sample_size(info.type));
  if (samples == NULL) {
    fprintf(stderr, "not enough memory for %zu samples\n", count);
    tagrid_reader_close(reader);
    return 1;
  }

  /* Every sample (NULL: steps of 1), without gaps (NULL: no strides), on two threads. */
  tagrid_call_init(&call);
  call.threads = 2;
  status = tagrid_reader_read(reader, &box, NULL, info.type, samples, NULL, &call);
  if (status != TAGRID_OK) return fail(reader, status, samples);

  for (i = 0; i < count; ++i) sum += sample_at(samples, info.type, i);
  printf("%zu samples, mean %g\n", count, sum / (double)count);
  free(samples);
  tagrid_reader_close(reader);
  return 0;
}
