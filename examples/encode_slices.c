/* Makes a ball in a volume, slice by slice, and encodes it. Only a few slices are in memory at once.
 *
 *     encode_slices ball.tag
 */
#include <stdio.h>
#include <stdlib.h>
#include <tagrid/tagrid.h>

enum { nx = 96, ny = 80, nz = 64 };

/* Takes the bytes of the file. Called by a thread of the encoder. */
static int write_bytes(void* user, const void* bytes, size_t count) {
  return fwrite(bytes, 1, count, (FILE*)user) == count ? 0 : 1;
}

/* Another program would show a progress bar. Any other value than 0 would cancel the call. */
static int show_progress(void* user, uint64_t done, uint64_t total) {
  *(double*)user = (double)done / (double)total;
  return 0;
}

static void make_slice(int z, int16_t* slice) {
  int x, y;
  for (y = 0; y < ny; ++y)
    for (x = 0; x < nx; ++x) {
      const int dx = x - nx / 2, dy = y - ny / 2, dz = z - nz / 2;
      slice[y * nx + x] = dx * dx + dy * dy + dz * dz < 25 * 25 ? 40 : -1000;
    }
}

int main(int argc, char** argv) {
  static int16_t slice[nx * ny];
  tagrid_geometry geometry = {.spacing = {0.5, 0.5, 1.25}, .has_spacing = 1};
  tagrid_encode_options options;
  tagrid_encoder* encoder = NULL;
  tagrid_info info;
  tagrid_call call;
  tagrid_status status;
  FILE* file;
  double part = 0;
  int z;

  if (argc != 2) {
    fprintf(stderr, "usage: encode_slices FILE\n");
    return 2;
  }
  file = fopen(argv[1], "wb");
  if (file == NULL) {
    perror(argv[1]);
    return 1;
  }

  tagrid_encode_options_init(&options);
  options.dims[0] = nx;
  options.dims[1] = ny;
  options.dims[2] = nz;
  options.type = TAGRID_INT16;
  options.geometry = &geometry;
  options.max_error = 2; /* the largest error of a sample; the default, 0, keeps every sample exactly */
  tagrid_call_init(&call);
  tagrid_info_init(&info);
  call.progress = show_progress;
  call.progress_user = &part;

  status = tagrid_encoder_open(&options, write_bytes, file, &call, &encoder);
  for (z = 0; z < nz && status == TAGRID_OK; ++z) {
    make_slice(z, slice);
    status = tagrid_encoder_write(encoder, slice, 1, NULL);
  }
  /* The file is complete only after this call. */
  if (status == TAGRID_OK) status = tagrid_encoder_finish(encoder, &info);
  if (status != TAGRID_OK)
    fprintf(stderr, "%s: %s\n", tagrid_status_text(status), tagrid_encoder_message(encoder));
  tagrid_encoder_close(encoder);
  if (fclose(file) != 0 && status == TAGRID_OK) {
    perror(argv[1]);
    status = TAGRID_IO_ERROR;
  }
  if (status != TAGRID_OK) {
    /* It may be a device, so it is not removed here. */
    fprintf(stderr, "%s is incomplete\n", argv[1]);
    return 1;
  }
  printf("%d%% done: %llu bytes, largest error %g\n", (int)(100 * part), (unsigned long long)info.file_bytes,
         info.achieved_max_error);
  return 0;
}
