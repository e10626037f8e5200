/* libtagrid: CT volumes as .tag files, read in parts and written from slices.
 *
 * A .tag file holds a volume of samples, each within a bound that was chosen when the file was written, and a
 * crack-free tetrahedral grid that is fine where the volume bends. It is a sequence of bricks, which are boxes
 * with edges of about 64 samples. Every brick can be decoded by itself: reading a part of a volume reads and
 * decodes only the bricks that meet the part.
 *
 *     tagrid_reader* reader;
 *     if (tagrid_reader_open_file("scan.tag", &reader) == TAGRID_OK) {
 *       const tagrid_box box = {{100, 100, 40}, {164, 164, 104}};
 *       int16_t* samples = malloc(64 * 64 * 64 * sizeof *samples);
 *       if (tagrid_reader_read(reader, &box, NULL, TAGRID_INT16, samples, NULL, NULL) != TAGRID_OK)
 *         fputs(tagrid_reader_message(reader), stderr);
 *     }
 *     tagrid_reader_close(reader);
 *
 * Conventions
 *   Axes        Three numbers are always x, y, z. Samples lie x fastest, then y, then z.
 *   Boxes       Half open: from `low` up to, but not including, `high`.
 *   Units       Errors and ranges are in units of the samples; spacing, origin and directions in those of the
 *               scan, mostly mm. Sizes are in bytes. Samples in memory have the byte order of the machine.
 *   Errors      Every function that can fail returns a tagrid_status. A message in English, with file, place
 *               and numbers, is kept: see tagrid_reader_message() and tagrid_encoder_message().
 *   Structs     A struct that begins with `struct_size` must be set up by its init function before it is
 *               passed to the library, even if the library fills it. It may grow in later versions; a program
 *               that was built with an older version keeps working, as its structs say how large they are. The
 *               inline function tagrid_..._init() passes this size; what calls the library without its header
 *               calls tagrid_..._init_sized().
 *   Threads     Any number of handles may be used at once. One reader may be used by several threads at once,
 *               one encoder by one thread at a time. Callbacks are called by threads of the library, unless
 *               stated otherwise.
 *   The process The library has no state of its own besides its handles and the last message of each thread
 *               that uses readers. It installs no signal handler, writes to no stream, reads no environment
 *               variable, changes no setting of the process and never ends it. Its only files are those that
 *               it is told to read, and the temporary ones of overviews, which have no names. Equal input
 *               gives equal bytes, for any number of threads.
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

/* Enumerations are ints, as in C: a caller may pass any value, and unknown ones are refused. */
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
#define TAGRID_VERSION_MAJOR 1
#define TAGRID_VERSION_MINOR 0 /* grows when something is added */
#define TAGRID_VERSION_PATCH 0 /* grows when nothing but the library changes */

/* The version of the library that is linked, as "1.0.0" or, before it is released, "1.0.0-rc.3". */
TAGRID_API const char* tagrid_version(void);

/* How a call ended. Values are never reused. */
typedef enum tagrid_status TAGRID_INT {
  TAGRID_OK = 0,
  /* An argument or an option is invalid, or cannot be combined with another one. */
  TAGRID_INVALID_ARGUMENT = 1,
  /* The file is damaged, truncated, or not a .tag file. No samples of a damaged brick are returned. */
  TAGRID_BROKEN_INPUT = 2,
  /* A file cannot be opened or read, or a callback reported a failure. */
  TAGRID_IO_ERROR = 3,
  /* The memory limit of the call cannot be kept. The message gives a limit that can. */
  TAGRID_MEMORY_LIMIT = 4,
  /* Memory ran out. */
  TAGRID_OUT_OF_MEMORY = 5,
  /* The progress callback asked to stop. */
  TAGRID_CANCELLED = 6,
  /* A bug in the library. Please report it with the message. */
  TAGRID_BUG = 7,
  /* The caller must give bytes of the file and call again. Only calls of tagrid_blocks.h return this. */
  TAGRID_NEEDS_BYTES = 8,
  /* The file is not damaged, but needs a newer version of the library. Nothing is returned of it. */
  TAGRID_NEWER_FORMAT = 9
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

/* Bytes of a sample; 0 for a number that is not a type. */
TAGRID_API size_t tagrid_sample_size(tagrid_type type);

/* The samples from `low` up to, but not including, `high`. */
typedef struct tagrid_box {
  int64_t low[3];  /* the first sample */
  int64_t high[3]; /* one beyond the last sample, along each axis */
} tagrid_box;

/* The position of the samples in the world. Sample (x, y, z) is at
 *     origin + x * directions[0] + y * directions[1] + z * directions[2].
 * If the source gave only spacings, the directions are those of the axes. */
typedef struct tagrid_geometry {
  double spacing[3];       /* distance of neighboring samples along each axis; NaN if unknown */
  double origin[3];        /* position of sample (0, 0, 0) */
  double directions[3][3]; /* directions[axis]: from a sample to the next one along that axis */
  int has_spacing, has_origin, has_directions; /* 1 if the source gave it, otherwise 0 */
} tagrid_geometry;

/* ----------------------------------------------------------------------------------------- resources of a call */

/* Called now and then with the number of bytes of samples that are done, and their total. Never called by two
 * threads at once. Return 0 to continue; any other value ends the call with TAGRID_CANCELLED. */
typedef int (*tagrid_progress)(void* user, uint64_t done, uint64_t total);

/* Limits of a call, and its progress. If a function takes a pointer to one, NULL stands for the defaults. */
typedef struct tagrid_call {
  size_t struct_size;
  int threads;              /* largest number of threads; 0: one for each core of the process (its affinity).
                             * A call has at most as many threads as oneTBB may have (one for each core; a
                             * global_control of the process changes that). All calls together have at most twice
                             * as many. If the system gives fewer threads, a call uses fewer. */
  uint64_t memory_limit;    /* bytes for the work of the call, without its results. 0: no limit is given; then
                             * the work aims at a quarter of the memory that the machine has for this process
                             * (that of its control group), and takes more if it needs more. Only an encoding
                             * that needs more than all of it is refused, with TAGRID_MEMORY_LIMIT. */
  tagrid_progress progress; /* may be NULL */
  void* progress_user;      /* passed to `progress` */
} tagrid_call;

/* Sets the defaults. */
TAGRID_API void tagrid_call_init_sized(tagrid_call* call, size_t size);
static inline void tagrid_call_init(tagrid_call* call) { tagrid_call_init_sized(call, sizeof *call); }

/* --------------------------------------------------------------------------------------------------- reading */

/* An open .tag file. */
typedef struct tagrid_reader tagrid_reader;

/* A .tag file anywhere that the caller can read from: in an archive, an object store, or memory. Both
 * functions return 0, or any other number if they fail. `read_at` fills all of `buffer`; it is called by
 * several threads at once, and never for bytes beyond `*bytes`. */
typedef struct tagrid_input {
  size_t struct_size;
  void* user;                                                              /* passed to both functions */
  int (*size)(void* user, uint64_t* bytes);                                /* sets the size of the file */
  int (*read_at)(void* user, uint64_t offset, void* buffer, size_t count); /* fills the buffer */
  const char* name;                                                        /* for messages; may be NULL */
} tagrid_input;

TAGRID_API void tagrid_input_init_sized(tagrid_input* input, size_t size);
static inline void tagrid_input_init(tagrid_input* input) { tagrid_input_init_sized(input, sizeof *input); }

/* Opens a file: reads its header and its last 256 KiB, which have the directory of its index, and checks their
 * checksums. The index itself is read page by page, when a brick is wanted.
 *
 * `*reader` is always set, even on failure, unless memory runs out, so that tagrid_reader_message() can say
 * what failed. It must always be closed. `path` is passed to the operating system as it is. */
TAGRID_API tagrid_status tagrid_reader_open_file(const char* path, tagrid_reader** reader);

/* The same for any input. The callbacks must stay valid until the reader is closed; the struct itself need
 * not. */
TAGRID_API tagrid_status tagrid_reader_open(const tagrid_input* input, tagrid_reader** reader);

/* Closes the reader. NULL is allowed. REQUIRES: no call on it is running. */
TAGRID_API void tagrid_reader_close(tagrid_reader* reader);

/* The message of the last failed call of this thread on a reader, if it was this reader; otherwise why the
 * reader could not be opened, for any thread; otherwise "". A thread keeps one message: ask for it before
 * using another reader. Valid until the next call of this thread on any reader. */
TAGRID_API const char* tagrid_reader_message(const tagrid_reader* reader);

#define TAGRID_MOST_THRESHOLDS 8 /* the most that a file can have */

/* The description of a file. All of it is known once the file is open. */
typedef struct tagrid_info {
  size_t struct_size;
  int64_t dims[3];          /* samples along x, y and z */
  tagrid_type type;         /* of the samples */
  tagrid_geometry geometry; /* where they are */

  /* How it was encoded. A bound that was not given is NaN. */
  int grid_only;    /* 1: a grid without stored voxels; samples are interpolated */
  int grid_derived; /* 1: voxels without a stored grid; it is computed from the decoded samples when needed */
  double max_error; /* no sample is further than this from the original */
  double surface_error; /* the tighter bound of the active points */
  double mesh_error;    /* no original sample is further than this from the field of the mesh */
  int cube;             /* edge of a root cube, in samples */
  int levels;           /* the levels of the grid are 0 up to this number */
  int accuracy;         /* m of the curvature criterion */
  double field_scale;   /* voxels per unit of value */
  double range[2];      /* the range of values that gave the field scale; NaN if there was none */

  /* Errors that were measured during encoding. NaN if unknown. */
  double achieved_max_error;  /* infinite if a sample that is not finite did not come back */
  double achieved_rmse;       /* the root of the mean of squared errors */
  double achieved_psnr;       /* in dB, with max - min of the original as peak; infinite if rmse is 0 */
  double achieved_mesh_error; /* of the field of the mesh, from the original samples */
  double low, high, mean;     /* of the finite samples of the original */

  /* Bytes of the file, or of this part of it. */
  uint64_t file_bytes, header_bytes, activity_bytes, value_bytes, index_bytes;

  int64_t bricks[3];      /* along x, y and z */
  int64_t brick_edge;     /* samples along the edge of a brick; the last one along an axis may be smaller */
  uint64_t active_points; /* vertices of the grid; 0 if it is derived: see tagrid_reader_levels() */
  int lead; /* 1: every brick but the last ones holds brick_edge samples along each axis, so that such
                           * a chunk is a brick; 0: the first ones hold one more */
  int unknown_parts; /* parts of a newer version in the file, which are not needed for the samples */

  /* Every sample is on the side of the original of each threshold: at least it, or below it. */
  int threshold_count;
  double thresholds[TAGRID_MOST_THRESHOLDS];         /* the least sample of the upper side, increasing */
  uint64_t samples_at_least[TAGRID_MOST_THRESHOLDS]; /* how many samples are on the upper side */
  uint64_t samples_moved[TAGRID_MOST_THRESHOLDS];    /* how many the loss had put on the other side */
} tagrid_info;

TAGRID_API void tagrid_info_init_sized(tagrid_info* info, size_t size);
static inline void tagrid_info_init(tagrid_info* info) { tagrid_info_init_sized(info, sizeof *info); }

/* Fills `*info`. */
TAGRID_API tagrid_status tagrid_reader_info(const tagrid_reader* reader, tagrid_info* info);

/* The metadata of the source: the lines of an NRRD header, each with a line feed, that do not describe how
 * samples are stored (space, units, key:=value pairs, ...). Valid as long as the reader. */
TAGRID_API const char* tagrid_reader_metadata(const tagrid_reader* reader);

/* The description of a brick, which needs no decoding. */
typedef struct tagrid_brick {
  size_t struct_size;
  tagrid_box box;         /* the samples that it holds; every sample is held by one brick */
  uint64_t offset;        /* of its first byte in the file */
  uint64_t bytes;         /* in the file */
  double low, high, mean; /* of the finite samples of the original; low > high if none is finite */
} tagrid_brick;

TAGRID_API void tagrid_brick_init_sized(tagrid_brick* brick, size_t size);
static inline void tagrid_brick_init(tagrid_brick* brick) { tagrid_brick_init_sized(brick, sizeof *brick); }

/* Fills `*brick` for the brick with this number: 0 up to bricks[0] * bricks[1] * bricks[2] - 1, x fastest. */
TAGRID_API tagrid_status tagrid_reader_brick(const tagrid_reader* reader, int64_t number,
                                             tagrid_brick* brick);

/* Reads the samples of `box`, which must lie within the volume, at low, low + step, low + 2 * step, ... along
 * each axis. `step` has three numbers of at least 1; NULL stands for 1, 1, 1. So there are
 * (high - low + step - 1) / step samples along each axis.
 *
 * `type` is that of the numbers in `samples`. It must be the type of the file, which tagrid_reader_info() has;
 * otherwise, nothing is read.
 *
 * `strides` gives the distances in bytes of neighboring samples in `samples` along x, y and z; NULL stands
 * for samples without gaps, x fastest. Strides may be negative; even then, `samples` points to the first
 * sample.
 *
 * Reads and decodes only the bricks that hold one of these samples. Memory: some MB for each thread, for any
 * size of the volume. Every brick is checked before its samples are returned; if the call fails, `samples`
 * may be partly filled. */
TAGRID_API tagrid_status tagrid_reader_read(const tagrid_reader* reader, const tagrid_box* box,
                                            const int64_t* step, tagrid_type type, void* samples,
                                            const int64_t* strides, const tagrid_call* call);

/* The most overviews that a file can have. */
#define TAGRID_MOST_OVERVIEWS 64

/* Writes the factors of the overviews of the file, which are downsampled copies of its volume, to `factors`, which
 * has room for TAGRID_MOST_OVERVIEWS numbers: from fine to coarse, and then zeros. */
TAGRID_API tagrid_status tagrid_reader_overviews(const tagrid_reader* reader, int64_t* factors);

/* Opens the overview with this factor, one of tagrid_reader_overviews(). It is a .tag file of its own: its
 * samples are means of blocks of factor * factor * factor samples, the last ones along an axis perhaps of fewer,
 * and its geometry says where they are.
 *
 * `*overview` is as after tagrid_reader_open_file(), and does not need `reader`; the callbacks of an input must
 * stay valid until both are closed. */
TAGRID_API tagrid_status tagrid_reader_overview(const tagrid_reader* reader, int64_t factor,
                                                tagrid_reader** overview);

/* Writes the number of volumes of the file to `count`: 1, or more if it holds several of the same size, which are
 * numbered from 0 on. Everything else that reads the file is about volume 0, except tagrid_reader_verify(). */
TAGRID_API tagrid_status tagrid_reader_volumes(const tagrid_reader* reader, int64_t* count);

/* Opens the volume with this number, a .tag file of its own. Its metadata may have its name: the pair
 * "volume_name".
 *
 * `*volume` is as `*overview` after tagrid_reader_overview(). */
TAGRID_API tagrid_status tagrid_reader_volume(const tagrid_reader* reader, int64_t number,
                                              tagrid_reader** volume);

/* Decodes the whole file and checks everything that can be checked without the original: checksums, that every
 * brick decodes, that the grid has no crack, that bricks agree on the faces that they share, and the
 * statistics. Returns TAGRID_BROKEN_INPUT if not; the message names the first thing that is wrong. */
TAGRID_API tagrid_status tagrid_reader_verify(const tagrid_reader* reader, const tagrid_call* call);

/* Writes the number of active points of each level of the grid to `active`, which has room for info.levels + 1
 * numbers. If the grid is derived, all of the file is decoded. */
TAGRID_API tagrid_status tagrid_reader_levels(const tagrid_reader* reader, uint64_t* active,
                                              const tagrid_call* call);

/* Takes a mesh, piece by piece; called by one thread at a time. Both functions return 0 to continue; any other
 * value ends the call with TAGRID_CANCELLED. */
typedef struct tagrid_mesh_sink {
  size_t struct_size;
  void* user; /* passed to both functions */
  /* Takes `count` more points: for each, three coordinates in the world and a sample of the volume's type. The
   * very first point has the number 0. */
  int (*points)(void* user, size_t count, const double* xyz, const void* values);
  /* Takes `count` more tetrahedra: for each, the numbers of four points in positive order, and its level; the
   * level modulo 3 is its primitive. A point may come after a tetrahedron that refers to it. */
  int (*tetrahedra)(void* user, size_t count, const int64_t* points, const uint8_t* levels);
} tagrid_mesh_sink;

TAGRID_API void tagrid_mesh_sink_init_sized(tagrid_mesh_sink* sink, size_t size);
static inline void tagrid_mesh_sink_init(tagrid_mesh_sink* sink) {
  tagrid_mesh_sink_init_sized(sink, sizeof *sink);
}

/* The part of the mesh. */
typedef struct tagrid_mesh_options {
  size_t struct_size;
  int level;             /* the grid up to this level, for a coarser mesh; -1: all of it */
  int padded;            /* 1: fills whole root cubes; 0: ends at the first and last samples */
  const tagrid_box* box; /* only tetrahedra that meet the box, from sample low to high - 1; NULL: all */
} tagrid_mesh_options;

TAGRID_API void tagrid_mesh_options_init_sized(tagrid_mesh_options* options, size_t size);
static inline void tagrid_mesh_options_init(tagrid_mesh_options* options) {
  tagrid_mesh_options_init_sized(options, sizeof *options);
}

/* Passes the tetrahedra of the grid to `sink`: a conforming mesh, with every point once. `options` may be NULL.
 *
 * The value of a point is that of its sample; in a grid without voxels it is the stored value. Tetrahedra that
 * reach beyond the last samples are cut there, unless the mesh is padded. A point that a cut makes lies on a
 * last plane of samples; its value is that of the piecewise linear field, rounded to the type, not that of
 * the sample there. A volume of one slice fills no space: it only has a padded mesh. With a box, only the
 * bricks around it are read, two layers of them are in memory, and progress counts layers of bricks; without
 * one, progress counts bytes of samples. */
TAGRID_API tagrid_status tagrid_reader_mesh(const tagrid_reader* reader, const tagrid_mesh_options* options,
                                            const tagrid_mesh_sink* sink, const tagrid_call* call);

/* A material of a mesh for solvers: a range of values, or a label. */
typedef struct tagrid_material {
  const char* name; /* up to 32 letters, digits and underscores, the first a letter; case does not count */
  double low, high; /* the values from low up to, but not including, high; may be infinite */
  int64_t label;    /* if samples are labels */
} tagrid_material;

/* What a mesh with materials is to have. Lengths are in the units of the file's spacing. */
typedef struct tagrid_material_mesh_options {
  size_t struct_size;
  const tagrid_material* materials; /* those to be meshed; values between two of them are of no material */
  size_t material_count;            /* the number of `materials` */
  int labels; /* 1: samples are labels; without materials, all labels but 0 are meshed */
  double
      smoothing; /* of interfaces of labels: the distance of the knots of B-splines, 0 to 4 samples; default 1 */
  double fine;           /* edge of the cubes at interfaces; 0: 2 * the smallest spacing */
  double coarse;         /* edge of the largest cubes; 0: 8 * fine */
  int best_angles;       /* 1: angles of 15 degrees or more instead of 9, for vertices that are less exact */
  int order;             /* 1: tetrahedra with 4 nodes; 2: with 10 */
  int largest_parts;     /* 1: only the largest connected part of each material */
  double least_volume;   /* only parts of at least this volume; 0: all */
  const tagrid_box* box; /* only tetrahedra that meet the box, from sample low to high - 1; NULL: all */
  const char* folder;    /* of temporary files, about 100 bytes per tetrahedron; NULL: /tmp */
} tagrid_material_mesh_options;

TAGRID_API void tagrid_material_mesh_options_init_sized(tagrid_material_mesh_options* options, size_t size);
static inline void tagrid_material_mesh_options_init(tagrid_material_mesh_options* options) {
  tagrid_material_mesh_options_init_sized(options, sizeof *options);
}

/* Takes a mesh with materials, piece by piece; called by one thread. All functions return 0 to continue; any other
 * value ends the call with TAGRID_CANCELLED. Names are valid until a function returns. */
typedef struct tagrid_material_mesh_sink {
  size_t struct_size;
  void* user; /* passed to all functions */
  /* Takes `count` more points, three coordinates in the world for each. They are numbered from 0 on. */
  int (*points)(void* user, size_t count, const double* xyz);
  /* Takes `count` more tetrahedra of a material: 4 or 10 numbers of points for each. The first 4 are corners in
   * positive order; the others are the middles of the edges 01, 12, 02, 03, 13, 23. `label`: that of the samples, or
   * the place of the material among all, by value, from 1 on. */
  int (*tetrahedra)(void* user, const char* material, int64_t label, size_t count, const int64_t* points);
  /* Takes `count` more triangles of a surface, such as bone_soft or bone_x_min: 3 or 6 numbers of points for each,
   * counterclockwise as seen from outside of the first material; then come the middles of the edges 01, 12, 02. */
  int (*triangles)(void* user, const char* surface, size_t count, const int64_t* points);
} tagrid_material_mesh_sink;

TAGRID_API void tagrid_material_mesh_sink_init_sized(tagrid_material_mesh_sink* sink, size_t size);
static inline void tagrid_material_mesh_sink_init(tagrid_material_mesh_sink* sink) {
  tagrid_material_mesh_sink_init_sized(sink, sizeof *sink);
}

/* Passes a mesh of materials to `sink`, as `tagrid mesh --materials` writes it: all points, then all tetrahedra, material
 * by material, then all triangles where a material ends. Values are slope * sample + intercept where the file has
 * them. Temporary files without a name hold the mesh until it is complete. Progress counts slices. */
TAGRID_API tagrid_status tagrid_reader_material_mesh(const tagrid_reader* reader,
                                                     const tagrid_material_mesh_options* options,
                                                     const tagrid_material_mesh_sink* sink,
                                                     const tagrid_call* call);

/* Takes a surface, piece by piece; called by one thread at a time. Both functions return 0 to continue; any other
 * value ends the call with TAGRID_CANCELLED. */
typedef struct tagrid_surface_sink {
  size_t struct_size;
  void* user; /* passed to both functions */
  /* Takes `count` more points: for each, three coordinates in the world. The very first point has the number 0. */
  int (*points)(void* user, size_t count, const double* xyz);
  /* Takes `count` more triangles: for each, the numbers of three points that came before. */
  int (*triangles)(void* user, size_t count, const int64_t* points);
} tagrid_surface_sink;

TAGRID_API void tagrid_surface_sink_init_sized(tagrid_surface_sink* sink, size_t size);
static inline void tagrid_surface_sink_init(tagrid_surface_sink* sink) {
  tagrid_surface_sink_init_sized(sink, sizeof *sink);
}

/* The part of the surface, and what its value means. */
typedef struct tagrid_surface_options {
  size_t struct_size;
  int level; /* the grid up to this level, for a coarser surface; -1: all of it */
  int close; /* 1: closed at the border of the volume, as if values outside were below `iso`, and around NaN */
  int rescaled; /* 1: `iso` is slope * sample + intercept where the file has a slope, as for `tagrid surface`;
                 * 0: `iso` is in the units of the samples */
  const tagrid_box* box; /* only tetrahedra that meet the box, from sample low to high - 1; NULL: all */
} tagrid_surface_options;

TAGRID_API void tagrid_surface_options_init_sized(tagrid_surface_options* options, size_t size);
static inline void tagrid_surface_options_init(tagrid_surface_options* options) {
  tagrid_surface_options_init_sized(options, sizeof *options);
}

/* Passes the isosurface of the piecewise linear field of the mesh to `sink`: the triangles between points with
 * at least the value `iso`, which are inside, and all others. `options` may be NULL.
 *
 * Triangles are counterclockwise if seen from outside. Within the volume, every edge has exactly two triangles;
 * every point comes once. A volume of one slice has no surface. With a box, only the bricks around it are read,
 * and progress counts layers of bricks; without one, progress counts bytes of samples. */
TAGRID_API tagrid_status tagrid_reader_surface(const tagrid_reader* reader, double iso,
                                               const tagrid_surface_options* options,
                                               const tagrid_surface_sink* sink, const tagrid_call* call);

/* --------------------------------------------------------------------------------------------------- writing */

/* How much time is spent to make the values of 8 and 16 bit samples smaller. */
typedef enum tagrid_effort TAGRID_INT {
  TAGRID_EFFORT_DEFAULT = 0,
  TAGRID_EFFORT_FAST = 1,
  TAGRID_EFFORT_BEST = 2
} tagrid_effort;

/* How the largest error follows from the samples. */
typedef enum tagrid_error_rule TAGRID_INT {
  TAGRID_RULE_NONE = 0,     /* it does not: max_error */
  TAGRID_RULE_NOISE = 1,    /* a multiple of the standard deviation of the noise */
  TAGRID_RULE_RELATIVE = 2, /* a fraction of the range of the samples: max - min */
  TAGRID_RULE_PSNR = 3,     /* the smallest file that reaches this many dB; with a max_error, both hold */
  TAGRID_RULE_RATIO = 4,    /* the best PSNR in a file that is so many times smaller than the samples */
  TAGRID_RULE_BITS = 5      /* the same in so many bits a sample */
} tagrid_error_rule;

/* Where the grid is. */
typedef enum tagrid_grid TAGRID_INT {
  TAGRID_GRID_DEFAULT = 0, /* derived with TAGRID_RULE_PSNR, _RATIO and _BITS, otherwise stored */
  TAGRID_GRID_STORED = 1,  /* in the file: of the original samples. Not with TAGRID_RULE_RATIO and _BITS */
  TAGRID_GRID_DERIVED = 2 /* nowhere; what needs one computes that of the decoded samples. Not with grid_only,
                            * surface_error or mesh_error. */
} tagrid_grid;

/* Reads `count` samples of the volume to encode, from number `first` on, x fastest. Returns 0, or any other value
 * if it fails; the call then fails with TAGRID_IO_ERROR. Called by one thread at a time, perhaps one of the
 * library, and only while tagrid_encoder_open() works. */
typedef int (*tagrid_read_samples)(void* user, int64_t first, int64_t count, void* samples);

/* The volume to encode, and the settings. dims and type must be set; the rest has defaults. */
typedef struct tagrid_encode_options {
  size_t struct_size;
  int64_t dims[3];                 /* samples along x, y and z */
  tagrid_type type;                /* of the samples */
  const tagrid_geometry* geometry; /* NULL: unknown */
  const char* metadata;            /* lines as of tagrid_reader_metadata(), up to 16 MiB; NULL: none */

  int grid_only;        /* 1: store only the grid; samples are interpolated */
  tagrid_grid grid;     /* where the grid is */
  double max_error;     /* NaN: 0, which keeps every sample exactly; with grid_only no bound */
  double surface_error; /* bound of the active points, below max_error; NaN: none */
  double mesh_error;    /* bound of the mesh; NaN: none */
  tagrid_effort effort; /* time for smaller values */

  int accuracy;       /* m of the curvature criterion: more is finer (20) */
  int cube;           /* edge of a root cube: a power of two, 4 .. 256 (32) */
  int brick;          /* root cubes along the edge of a brick; 0: max(2, 64 / cube) */
  int max_level;      /* no point of a higher level is marked; -1: no limit */
  double range[2];    /* the range of values that matters for the grid; NaN: the usual range of the type */
  double field_scale; /* voxels per unit of value, instead of a range; NaN: from the range. Types of 32 and 64
                       * bits need a range, a field scale, or read_samples, which gives the range. */

  /* What follows from the samples needs them before they are written. */
  tagrid_error_rule error_rule;     /* instead of max_error; needs read_samples */
  double error_rule_value;          /* the multiple, fraction, dB, ratio or bits */
  int range_from_data;              /* 1: the range is that of the samples; needs read_samples */
  tagrid_read_samples read_samples; /* NULL: samples come from tagrid_encoder_write() alone */
  void* read_user;                  /* passed to read_samples */

  int lead; /* 1: the lattice begins one step before the first sample, so that every brick owns as many samples
             * as its edge has; 0: at the first sample, for volumes of 2^k n + 1 samples (1) */

  /* Overviews are downsampled copies of the volume; see tagrid_reader_overviews(). While slices are encoded,
   * sums of blocks wait in a temporary file without a name, up to a sixteenth of the bytes of the samples. If
   * it cannot be created, written or read, the call fails with TAGRID_IO_ERROR. */
  const int64_t* overviews; /* the factors, which are increasing powers of 4 from 4 to 1024, and then 0; only
                             * 0: none; NULL: as `tagrid encode` does by default, 4, 16 ... until the longest
                             * axis has at most 256 samples, and none if the longest axis of the volume has at
                             * most 512, or with grid_only */
  const char* spool;        /* the directory for temporary files, which only overviews need; NULL: "/tmp" */

  /* No sample changes its side of these values, whatever the bound allows: decoded, it is at least a threshold if the
   * original is, and otherwise below it. At most TAGRID_MOST_THRESHOLDS, increasing. */
  const double* thresholds; /* NULL: none */
  size_t threshold_count;   /* the number of `thresholds` */
} tagrid_encode_options;

TAGRID_API void tagrid_encode_options_init_sized(tagrid_encode_options* options, size_t size);
static inline void tagrid_encode_options_init(tagrid_encode_options* options) {
  tagrid_encode_options_init_sized(options, sizeof *options);
}

/* Takes the bytes of the file, in order. Returns 0, or any other value if it fails; the encoder then fails with
 * TAGRID_IO_ERROR. Called by one thread at a time. */
typedef int (*tagrid_write)(void* user, const void* bytes, size_t count);

/* An encoder at work. */
typedef struct tagrid_encoder tagrid_encoder;

/* Begins a .tag file. tagrid_encoder_write() takes slices; threads of the encoder pass bytes to `write`. Equal
 * samples and options give equal bytes, which are also those of `tagrid encode`.
 *
 * As with a reader, `*encoder` is always set unless memory runs out, and must be closed. */
TAGRID_API tagrid_status tagrid_encoder_open(const tagrid_encode_options* options, tagrid_write write,
                                             void* user, const tagrid_call* call, tagrid_encoder** encoder);

/* Takes the next `slices` slices of dims[0] * dims[1] samples. `strides` as in tagrid_reader_read(). The samples
 * are copied; the call waits while the encoder has enough to do. */
TAGRID_API tagrid_status tagrid_encoder_write(tagrid_encoder* encoder, const void* samples, int64_t slices,
                                              const int64_t* strides);

/* Waits until the last byte has been written. REQUIRES: all slices were written; otherwise it returns
 * TAGRID_INVALID_ARGUMENT. The file is complete only if this returns TAGRID_OK. If `info` is not NULL, it is
 * filled as by tagrid_reader_info(). */
TAGRID_API tagrid_status tagrid_encoder_finish(tagrid_encoder* encoder, tagrid_info* info);

/* Closes the encoder; an unfinished one is cancelled. NULL is allowed. */
TAGRID_API void tagrid_encoder_close(tagrid_encoder* encoder);

/* The message of the last failed call; "" if none failed. */
TAGRID_API const char* tagrid_encoder_message(const tagrid_encoder* encoder);

/* The smallest memory_limit that an encoder with these options can keep; 0 if the options are invalid. */
TAGRID_API uint64_t tagrid_encode_memory(const tagrid_encode_options* options);

#ifdef __cplusplus
}
#endif

#endif
