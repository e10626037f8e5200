/* libtagrid, a block at a time: .tag files whose bytes the caller fetches, and bricks that it decodes where
 * it wants.
 *
 * tagrid.h reads a file through a callback that must return with the bytes, on threads of its own. A
 * browser fetches asynchronously, and decodes in workers that share no memory. So here the library never
 * reads: it says which bytes it needs, the caller gives them and calls again. And a brick is decoded from
 * nothing but the header of its file and the bytes of its block.
 *
 *     tagrid_blocks* blocks;
 *     tagrid_blocks_create(size_of_file, &blocks);
 *     while ((status = tagrid_blocks_open(blocks)) == TAGRID_NEEDS_BYTES) {
 *       const tagrid_range* ranges;
 *       const size_t count = tagrid_blocks_needs(blocks, &ranges);
 *       for (size_t i = 0; i < count; ++i)
 *         tagrid_blocks_give(blocks, ranges[i].offset, fetched(ranges[i]), ranges[i].bytes);
 *     }
 *
 * This half of the library needs no threads, no files and no oneTBB; see docs/dev/web.md. The conventions are
 * those of tagrid.h, except that a handle is used by one thread at a time.
 */
#ifndef TAGRID_TAGRID_BLOCKS_H
#define TAGRID_TAGRID_BLOCKS_H

#include "tagrid/tagrid.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---------------------------------------------------------------------------------------- where bytes are */

/* Bytes of the file. */
typedef struct tagrid_range {
  uint64_t offset; /* of the first byte in the file */
  uint64_t bytes;  /* their number */
} tagrid_range;

/* What is known of a file, or of an overview or a volume in it. */
typedef struct tagrid_blocks tagrid_blocks;

/* A file of so many bytes, of which nothing is known yet. If memory runs out, `*blocks` is NULL. */
TAGRID_API tagrid_status tagrid_blocks_create(uint64_t file_bytes, tagrid_blocks** blocks);

/* NULL is allowed. */
TAGRID_API void tagrid_blocks_close(tagrid_blocks* blocks);

/* The message of the last failed call; "" if none failed. */
TAGRID_API const char* tagrid_blocks_message(const tagrid_blocks* blocks);

/* The ranges that the last call lacked, if it returned TAGRID_NEEDS_BYTES: their number, and the first of
 * them. All lie within the file. Offsets are those of the whole file, also of an overview or a volume in
 * it. Valid until the next call. */
TAGRID_API size_t tagrid_blocks_needs(const tagrid_blocks* blocks, const tagrid_range** ranges);

/* Gives the bytes of a range, all of it at once. They are copied, and kept until a call returns anything but
 * TAGRID_NEEDS_BYTES. */
TAGRID_API tagrid_status tagrid_blocks_give(tagrid_blocks* blocks, uint64_t offset, const void* bytes,
                                            size_t count);

/* Reads header and directory, and checks them: at most the first 4 KiB (or all of a larger header) and the
 * last 256 KiB of the file, plus 256 KiB if parity follows it. */
TAGRID_API tagrid_status tagrid_blocks_open(tagrid_blocks* blocks);

/* As tagrid_reader_info(), tagrid_reader_metadata(), tagrid_reader_overviews() and tagrid_reader_volumes().
 * REQUIRES: tagrid_blocks_open() returned TAGRID_OK; otherwise TAGRID_INVALID_ARGUMENT, or "". */
TAGRID_API tagrid_status tagrid_blocks_info(tagrid_blocks* blocks, tagrid_info* info);
TAGRID_API const char* tagrid_blocks_metadata(const tagrid_blocks* blocks); /* as tagrid_reader_metadata() */
TAGRID_API tagrid_status tagrid_blocks_overviews(tagrid_blocks* blocks,
                                                 int64_t* factors);                    /* as of a reader */
TAGRID_API tagrid_status tagrid_blocks_volumes(tagrid_blocks* blocks, int64_t* count); /* as of a reader */

/* 1 if the file stores the grid of its bricks, 0 if it is computed from decoded samples, or the file is not
 * open. */
TAGRID_API int tagrid_blocks_stores_grid(const tagrid_blocks* blocks);

/* The bytes of the header, which a decoder needs. Valid as long as `blocks`; NULL if it is not open. */
TAGRID_API const void* tagrid_blocks_header(const tagrid_blocks* blocks, size_t* bytes);

/* Opens an overview or a volume, as tagrid_reader_overview() and tagrid_reader_volume() do. The result is
 * open, and may outlive `blocks`, to which bytes are given while this returns TAGRID_NEEDS_BYTES. Both share
 * the bytes that are given, so one thread at a time uses either of them. If the call does not return
 * TAGRID_OK, the result is NULL. */
TAGRID_API tagrid_status tagrid_blocks_overview(tagrid_blocks* blocks, int64_t factor,
                                                tagrid_blocks** overview);
TAGRID_API tagrid_status tagrid_blocks_volume(tagrid_blocks* blocks, int64_t number,
                                              tagrid_blocks** volume); /* the same */

/* A brick, and where its block is. */
typedef struct tagrid_block {
  int64_t number;          /* of the brick */
  tagrid_box box;          /* the samples that the brick holds */
  tagrid_range range;      /* the block, with the eight bytes before it, to which it is bound */
  uint64_t activity_bytes; /* what the index says of it */
  int64_t slices;          /* from its first one on, that reach to the end of the box that was asked for */
} tagrid_block;

/* Fills `found`, which has room for `room` of them, with the bricks that hold samples of `box`, in the
 * order of their numbers, from the one numbered `first` among them on. `*count` receives how many: fewer
 * than `room` if these are the last. Needs the pages of the index that have these bricks. */
TAGRID_API tagrid_status tagrid_blocks_plan(tagrid_blocks* blocks, const tagrid_box* box, int64_t first,
                                            tagrid_block* found, size_t room, size_t* count);

/* ----------------------------------------------------------------------------------------------- decoding */

/* Decodes bricks of one file. */
typedef struct tagrid_decoder tagrid_decoder;

/* For a file with this header; see tagrid_blocks_header(). The bytes need not stay. `*decoder` is always
 * set, unless memory runs out, and must be closed. */
TAGRID_API tagrid_status tagrid_decoder_open(const void* header, size_t bytes, tagrid_decoder** decoder);

/* NULL is allowed. */
TAGRID_API void tagrid_decoder_close(tagrid_decoder* decoder);

/* The message of the last failed call; "" if none failed. */
TAGRID_API const char* tagrid_decoder_message(const tagrid_decoder* decoder);

/* The most bytes of memory that tagrid_decoder_decode() takes for this block, with its samples and without
 * the bytes of the caller. 0 if there is no such brick. */
TAGRID_API uint64_t tagrid_decoder_memory(const tagrid_decoder* decoder, const tagrid_block* block);

/* Checks and decodes a block. `bytes` are those of block->range. At least block->slices slices of the
 * brick are decoded, or all of it if that is not 1 up to the slices of its box; in a file without stored
 * voxels, always all.
 *
 * `*samples` receives the samples of these slices, x fastest, in the byte order of the machine, and
 * `*sample_bytes` their number of bytes. They are valid until the next call with this decoder. If the call
 * fails, there are none. */
TAGRID_API tagrid_status tagrid_decoder_decode(tagrid_decoder* decoder, const tagrid_block* block,
                                               const void* bytes, size_t count, const void** samples,
                                               size_t* sample_bytes);

/* Decodes the activity of a brick: which points of its closed box are vertices of the grid. The closed box has
 * the samples of the brick and those on its low faces, and reaches to the end of its last root cubes, so also
 * beyond the volume. The file must store its grid. The activity depends on all samples of the brick, whatever
 * block->slices is.
 *
 * `*box` receives the closed box; its coordinates may be negative. `*words` receives a bit for each point of
 * it, valid until the next call with this decoder: each row along x begins with a new number of 64 bits, whose
 * lowest bit is its first point. If the call fails, there are none. */
TAGRID_API tagrid_status tagrid_decoder_activity(tagrid_decoder* decoder, const tagrid_block* block,
                                                 const void* bytes, size_t count, tagrid_box* box,
                                                 const uint64_t** words, size_t* word_count);

/* The most bytes of memory that tagrid_decoder_activity() takes for this block, as tagrid_decoder_memory(). */
TAGRID_API uint64_t tagrid_decoder_activity_memory(const tagrid_decoder* decoder, const tagrid_block* block);

/* The edges of the grid of the brick `number` in the slice `slice` across `axis`, which must be one of the
 * samples that it holds, from its activity: the borders of what the plane cuts out of the tetrahedra, each
 * once. `*edges` receives four numbers for each: where it begins and where it ends, along the two other axes,
 * the lower one first, in samples. Valid until the next call with this decoder. They reach beyond the volume
 * as the closed box does. Takes at most 6 KiB of memory for each point of the closed box in the slice, whatever
 * the words are, and with the edges: 25 MiB for a brick of 64 samples. */
TAGRID_API tagrid_status tagrid_decoder_edges(tagrid_decoder* decoder, int64_t number, const uint64_t* words,
                                              size_t word_count, int axis, int64_t slice,
                                              const int64_t** edges, size_t* edge_count);

#ifdef __cplusplus
}
#endif

#endif
