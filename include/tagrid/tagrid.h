/* libtagrid: CT volumes as .tag files, read in parts and written from slices.
 *
 * A .tag file holds a volume of samples, every one within a bound that was chosen when it was written, and a
 * crack-free tetrahedral grid that is fine where the volume bends. It is a row of bricks, boxes of about 64
 * samples an edge, and every brick can be decoded by itself: reading a part of a volume reads and decodes the
 * bricks that the part meets, and no others.
 *
 *     tagrid_reader* reader;
 *     if (tagrid_reader_open_file("scan.tag", &reader) == TAGRID_OK) {
 *       const tagrid_box box = {{100, 100, 40}, {164, 164, 104}};
 *       int16_t* samples = malloc(64 * 64 * 64 * sizeof *samples);
 *       if (tagrid_reader_read(reader, &box, NULL, samples, NULL, NULL) != TAGRID_OK)
 *         fputs(tagrid_reader_message(reader), stderr);
 *     }
 *     tagrid_reader_close(reader);
 *
 * Conventions
 *   Axes        Three numbers are always x, y, z. Samples lie x fastest, then y, then z.
 *   Boxes       Half open: from `low` up to, but without, `high`.
 *   Units       Errors and ranges are in units of the samples; spacing, origin and directions in those of the
 *               scan, mostly mm. Sizes are in bytes. Samples in memory have the byte order of the machine.
 *   Errors      Every function that can fail returns a tagrid_status. A message in English, with file, place
 *               and numbers, is kept: see tagrid_reader_message(), tagrid_encoder_message().
 *   Structs     A struct that begins with `struct_size` must be set up by its init function before it is handed
 *               to the library, also one that the library fills. It may grow in later versions; a program that
 *               was built with an older one goes on working.
 *   Threads     Any number of handles may be used at once. One reader may be used by several threads at once,
 *               one encoder by one thread at a time. Callbacks are called by threads of the library, unless it
 *               says otherwise.
 *   The process The library has no state of its own besides its handles and the last message of each thread that
 *               uses readers. It installs no signal handler, writes
 *               to no stream, reads no environment variable, changes no setting of the process and never ends
 *               it. Same input, same bytes, whatever the number of threads.
 */
#ifndef TAGRID_TAGRID_H
#define TAGRID_TAGRID_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define TAGRID_API __attribute__((visibility("default")))
#else
#define TAGRID_API
#endif

/* An enumeration is an int, as in C: one that comes from elsewhere may have any value, and is refused. */
#ifdef __cplusplus
#define TAGRID_INT : int
#else
#define TAGRID_INT
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------ version, status */

/* The version of these declarations. */
#define TAGRID_VERSION_MAJOR 0
#define TAGRID_VERSION_MINOR 1
#define TAGRID_VERSION_PATCH 0

/* The version of the library that is linked, as "0.1.0". */
TAGRID_API const char* tagrid_version(void);

/* How a call ended. Values are never reused. */
typedef enum tagrid_status TAGRID_INT {
  TAGRID_OK = 0,
  /* An argument or an option makes no sense, or does not go with another one. */
  TAGRID_INVALID_ARGUMENT = 1,
  /* The file is damaged, truncated, or no .tag file. No samples of a damaged brick are handed out. */
  TAGRID_BROKEN_INPUT = 2,
  /* A file cannot be opened or read, or a callback reported a failure. */
  TAGRID_IO_ERROR = 3,
  /* The memory limit of the call cannot be kept; the message says which limit can. */
  TAGRID_MEMORY_LIMIT = 4,
  /* Memory ran out. */
  TAGRID_OUT_OF_MEMORY = 5,
  /* The progress callback asked to stop. */
  TAGRID_CANCELLED = 6,
  /* A mistake of the library. Please report it with the message. */
  TAGRID_BUG = 7
} tagrid_status;

/* A status in a few words of English, for example "broken input". */
TAGRID_API const char* tagrid_status_text(tagrid_status status);

/* --------------------------------------------------------------------------------------------------- volumes */

/* Types of samples. */
typedef enum tagrid_type TAGRID_INT {
  TAGRID_UINT8 = 1,
  TAGRID_INT8 = 2,
  TAGRID_UINT16 = 3,
  TAGRID_INT16 = 4,
  TAGRID_UINT32 = 5,
  TAGRID_INT32 = 6,
  TAGRID_FLOAT32 = 7,
  TAGRID_FLOAT64 = 8
} tagrid_type;

/* Bytes of a sample; 0 for a number that is no type. */
TAGRID_API size_t tagrid_sample_size(tagrid_type type);

/* The samples from `low` up to, but without, `high`. */
typedef struct tagrid_box {
  int64_t low[3];
  int64_t high[3];
} tagrid_box;

/* Where the samples lie in the world. Sample (x, y, z) is at
 *     origin + x * directions[0] + y * directions[1] + z * directions[2].
 * Where the source gave spacings alone, the directions are those of the axes. */
typedef struct tagrid_geometry {
  double spacing[3];       /* distance of neighbouring samples on each axis; NaN where it is not known */
  double origin[3];        /* position of sample (0, 0, 0) */
  double directions[3][3]; /* directions[axis]: from a sample to the next one along that axis */
  int has_spacing, has_origin, has_directions; /* 1 where the source said so, else 0 */
} tagrid_geometry;

/* --------------------------------------------------------------------------------------------- what a call may take */

/* Called now and then with the bytes of samples that are done, and of all. Never called by two threads at
 * once. Return 0 to go on; anything else ends the call with TAGRID_CANCELLED. */
typedef int (*tagrid_progress)(void* user, uint64_t done, uint64_t total);

/* How a call may work. Where a function takes a pointer to one, NULL stands for the defaults. */
typedef struct tagrid_call {
  size_t struct_size;
  int threads;              /* at most so many; 0: as many as this process may run on (its affinity).
                             * oneTBB gives all calls of a process together as many as the machine has, besides
                             * those that call; a global_control of the process changes that. */
  uint64_t memory_limit;    /* bytes for the work of the call, besides what it hands out. 0: none is set; then
                             * the work aims at a quarter of the memory that the machine has for this process
                             * (that of its control group), and takes more where it needs more. Only an encoding
                             * that needs more than all of it is refused, with TAGRID_MEMORY_LIMIT. */
  tagrid_progress progress; /* may be NULL */
  void* progress_user;      /* handed to `progress` */
} tagrid_call;

/* Sets the defaults. */
TAGRID_API void tagrid_call_init(tagrid_call* call);

/* --------------------------------------------------------------------------------------------------- reading */

/* An open .tag file. */
typedef struct tagrid_reader tagrid_reader;

/* A .tag file that lies wherever the caller can read from: an archive, an object store, memory. Both
 * functions return 0, or any other number where they fail. `read_at` fills all of `buffer`; it is called by
 * several threads at once, and never for bytes beyond `*bytes`. */
typedef struct tagrid_input {
  size_t struct_size;
  void* user; /* handed to both functions */
  int (*size)(void* user, uint64_t* bytes);
  int (*read_at)(void* user, uint64_t offset, void* buffer, size_t count);
  const char* name; /* for messages; may be NULL */
} tagrid_input;

TAGRID_API void tagrid_input_init(tagrid_input* input);

/* Opens a file: reads its header, its index and its footer, and checks their checksums.
 *
 * `*reader` is set in any case, unless memory runs out, so that tagrid_reader_message() can say what failed;
 * it has to be closed in any case. `path` is handed to the operating system as it is. */
TAGRID_API tagrid_status tagrid_reader_open_file(const char* path, tagrid_reader** reader);

/* The same of any input. The callbacks must stay valid until the reader is closed; the struct itself need
 * not. */
TAGRID_API tagrid_status tagrid_reader_open(const tagrid_input* input, tagrid_reader** reader);

/* Closes the reader. NULL is allowed. REQUIRES: no call on it is under way. */
TAGRID_API void tagrid_reader_close(tagrid_reader* reader);

/* What the last failed call of this thread on a reader has to say, if that was this reader; else why the reader
 * could not be opened, for any thread; else "". A thread keeps one message: ask before it uses another reader.
 * Valid until the next call of this thread on any reader. */
TAGRID_API const char* tagrid_reader_message(const tagrid_reader* reader);

/* What a file is. All of it is known once the file is open. */
typedef struct tagrid_info {
  size_t struct_size;
  int64_t dims[3];
  tagrid_type type;
  tagrid_geometry geometry;

  /* How it was encoded. A bound that was not given is NaN. */
  int grid_only;        /* 1: a grid without voxels of its own; samples are interpolated in it */
  double max_error;     /* no sample is further than this from the original */
  double surface_error; /* the tighter bound of the active points */
  double mesh_error;    /* no original sample is further than this from the field of the mesh */
  int cube;             /* edge of a root cube, in samples */
  int levels;           /* of the grid: 0 up to this number */
  int accuracy;
  double field_scale;
  double range[2]; /* the range of values that the field scale came from; NaN where there was none */

  /* What was measured against the original while it was encoded. NaN where it is not known. */
  double achieved_max_error; /* infinite where a sample that is not finite did not come back */
  double achieved_rmse;
  double achieved_psnr; /* in dB, with max - min of the original as peak; infinite where rmse is 0 */
  double achieved_mesh_error;
  double low, high, mean; /* of the finite samples of the original */

  /* Sizes, in bytes. */
  uint64_t file_bytes, header_bytes, activity_bytes, value_bytes, index_bytes;

  int64_t bricks[3];      /* along x, y and z */
  int64_t brick_edge;     /* samples an edge of a brick, but for the last on an axis */
  uint64_t active_points; /* vertices of the grid */
} tagrid_info;

TAGRID_API void tagrid_info_init(tagrid_info* info);

/* Fills `*info`. */
TAGRID_API tagrid_status tagrid_reader_info(const tagrid_reader* reader, tagrid_info* info);

/* What the source said besides its samples: the lines of an NRRD header, each with a line feed, that do not
 * describe how samples are stored (space, units, key:=value pairs, ...). Valid as long as the reader. */
TAGRID_API const char* tagrid_reader_metadata(const tagrid_reader* reader);

/* What is known of a brick without decoding it. */
typedef struct tagrid_brick {
  size_t struct_size;
  tagrid_box box;         /* the samples that it holds; every sample is held by one brick */
  uint64_t offset;        /* of its first byte in the file */
  uint64_t bytes;         /* in the file */
  double low, high, mean; /* of the finite samples of the original; low > high where none is finite */
} tagrid_brick;

TAGRID_API void tagrid_brick_init(tagrid_brick* brick);

/* Fills `*brick`. The brick with this number: 0 up to bricks[0] * bricks[1] * bricks[2] - 1, x fastest. */
TAGRID_API tagrid_status tagrid_reader_brick(const tagrid_reader* reader, int64_t number,
                                             tagrid_brick* brick);

/* Reads samples: of `box`, which lies within the volume, those at low, low + step, low + 2 * step, ... on each
 * axis. `step` has three numbers from 1 on; NULL stands for 1, 1, 1. So on each axis there are
 * (high - low + step - 1) / step of them.
 *
 * `strides` says how far apart, in bytes, neighbouring samples lie in `samples` along x, y and z; NULL stands
 * for samples without gaps, x fastest. Strides may be negative, then `samples` points to the first sample all
 * the same.
 *
 * Reads and decodes the bricks that have one of these samples, and nothing else. Memory: some MB for each
 * thread, whatever the size of the volume. Every brick is checked before samples of it are handed out; where
 * the call fails, `samples` may be filled in part. */
TAGRID_API tagrid_status tagrid_reader_read(const tagrid_reader* reader, const tagrid_box* box,
                                            const int64_t* step, void* samples, const int64_t* strides,
                                            const tagrid_call* call);

/* Decodes the whole file and checks everything that can be checked without the original: checksums, that every
 * brick decodes, that the grid has no crack, that bricks agree on the faces that they share, and the
 * statistics. TAGRID_BROKEN_INPUT with the first thing that is wrong. */
TAGRID_API tagrid_status tagrid_reader_verify(const tagrid_reader* reader, const tagrid_call* call);

/* Takes a mesh, piece by piece; called by one thread at a time. Both functions return 0 to go on; anything else
 * ends the call with TAGRID_CANCELLED. */
typedef struct tagrid_mesh_sink {
  size_t struct_size;
  void* user; /* handed to both functions */
  /* `count` more points: three coordinates in the world each, and a sample each, of the volume's type. The
   * first point of all has the number 0. */
  int (*points)(void* user, size_t count, const double* xyz, const void* values);
  /* `count` more tetrahedra: the numbers of four points each, in positive order, and the level of each, which
   * modulo 3 is its primitive. A point may come after the tetrahedron that names it. */
  int (*tetrahedra)(void* user, size_t count, const int64_t* points, const uint8_t* levels);
} tagrid_mesh_sink;

TAGRID_API void tagrid_mesh_sink_init(tagrid_mesh_sink* sink);

/* Which part of the mesh. */
typedef struct tagrid_mesh_options {
  size_t struct_size;
  int level;             /* the grid up to this level, for a coarser mesh; -1: all of it */
  int padded;            /* 1: fills whole root cubes; 0: ends at the first and last samples */
  const tagrid_box* box; /* only tetrahedra that meet the box, from sample low to high - 1; NULL: all */
} tagrid_mesh_options;

TAGRID_API void tagrid_mesh_options_init(tagrid_mesh_options* options);

/* Hands the tetrahedra of the grid to `sink`: a conforming mesh, every point once. `options` may be NULL.
 *
 * The value of a point is that of its sample; of a grid without voxels the stored one. Tetrahedra that reach
 * beyond the last samples are cut there, unless the mesh is padded. A volume of one slice fills no space: it has
 * a padded mesh only. With a box, only bricks around it are read, two layers of them are in memory, and
 * progress is in layers of bricks; without one, in bytes of samples. */
TAGRID_API tagrid_status tagrid_reader_mesh(const tagrid_reader* reader, const tagrid_mesh_options* options,
                                            const tagrid_mesh_sink* sink, const tagrid_call* call);

/* --------------------------------------------------------------------------------------------------- writing */

/* How small the values of 8 and 16 bit samples are made, at the cost of time. */
typedef enum tagrid_effort TAGRID_INT {
  TAGRID_EFFORT_DEFAULT = 0,
  TAGRID_EFFORT_FAST = 1,
  TAGRID_EFFORT_BEST = 2
} tagrid_effort;

/* What is encoded, and how. dims and type have to be set; the rest has defaults. */
typedef struct tagrid_encode_options {
  size_t struct_size;
  int64_t dims[3];
  tagrid_type type;
  const tagrid_geometry* geometry; /* NULL: nothing is known */
  const char* metadata; /* more lines of an NRRD header, see tagrid_reader_metadata(), up to 16 MiB; NULL: none */

  int grid_only;        /* 1: keep the grid alone; samples are interpolated in it */
  double max_error;     /* NaN: 0, every sample exactly, or with grid_only no bound */
  double surface_error; /* bound of the active points, below max_error; NaN: none */
  double mesh_error;    /* bound of the mesh; NaN: none */
  tagrid_effort effort;

  int accuracy;       /* m of the curvature criterion: more is finer (20) */
  int cube;           /* edge of a root cube: a power of two, 4 .. 256 (32) */
  int brick;          /* root cubes an edge of a brick; 0: max(2, 64 / cube) */
  int max_level;      /* no point of a higher level is asked for; -1: no limit */
  double range[2];    /* the span of values that matters, for the grid; NaN: the usual one of the type */
  double field_scale; /* voxels per unit of value, instead of a range; NaN: from the range. Types of 32 and 64
                       * bits need a range or a field scale. */
} tagrid_encode_options;

TAGRID_API void tagrid_encode_options_init(tagrid_encode_options* options);

/* Takes the bytes of the file, in order. Returns 0, or anything else where it fails: then the encoder fails
 * with TAGRID_IO_ERROR. Called by one thread at a time. */
typedef int (*tagrid_write)(void* user, const void* bytes, size_t count);

/* An encoder at work. */
typedef struct tagrid_encoder tagrid_encoder;

/* Begins a .tag file. Slices are fed by tagrid_encoder_write(), bytes come out by `write`, from threads of the
 * encoder. The same samples and options give the same bytes, which are also those of `tagrid encode`.
 *
 * As with a reader, `*encoder` is set in any case unless memory runs out, and has to be closed. */
TAGRID_API tagrid_status tagrid_encoder_open(const tagrid_encode_options* options, tagrid_write write,
                                             void* user, const tagrid_call* call, tagrid_encoder** encoder);

/* Feeds the next `slices` slices of dims[0] * dims[1] samples. `strides` as in tagrid_reader_read(). The samples
 * are copied; the call waits while the encoder has enough to do. */
TAGRID_API tagrid_status tagrid_encoder_write(tagrid_encoder* encoder, const void* samples, int64_t slices,
                                              const int64_t* strides);

/* Waits until the last byte was written. REQUIRES: all slices were fed; else TAGRID_INVALID_ARGUMENT. The file
 * is whole only if this returns TAGRID_OK. `info`, where it is not NULL, is filled as by tagrid_reader_info(). */
TAGRID_API tagrid_status tagrid_encoder_finish(tagrid_encoder* encoder, tagrid_info* info);

/* Ends the encoder; one that is not finished is cancelled. NULL is allowed. */
TAGRID_API void tagrid_encoder_close(tagrid_encoder* encoder);

/* What the last failed call has to say; "" where none failed. */
TAGRID_API const char* tagrid_encoder_message(const tagrid_encoder* encoder);

/* The smallest memory_limit that an encoder with these options can keep; 0 where the options make no sense. */
TAGRID_API uint64_t tagrid_encode_memory(const tagrid_encode_options* options);

#ifdef __cplusplus
}
#endif

#endif
