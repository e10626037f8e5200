#include "pipeline/memory/plan.h"

#include <algorithm>
#include <cmath>

#include "io/tag/pages.h"
#include "stages/brick/closed_samples.h"
#include "stages/brick/codec.h"
#include "stages/criterion/marking.h"
#include "stages/criterion/subdivide.h"
#include "stages/grid/lattice_bits.h"
#include "stages/mesh/mesh_error.h"
#include "stages/overview/block_sums.h"

namespace tagrid {
namespace {

// For a hostile header, sums over all bricks need more than 64 bits. The memory of one brick does not.
using ByteCount = double;

// What is allocated besides the data themselves: the object, what shares it, and the blocks of the heap.
constexpr ByteCount bytes_of_array = 64;      // a vector in a list, and its block
constexpr ByteCount bytes_of_object = 128;    // a shared slice, or the bits of a box
constexpr ByteCount bytes_of_tile = 250;      // the marks of a tile, in the map of the schedule
constexpr ByteCount bytes_of_face = 250;      // a face with its bits and values, in the map of shared faces
constexpr ByteCount bytes_of_job = 700;       // a tile or a brick that waits for a thread, and its message
constexpr ByteCount bytes_of_pointer = 16;    // a shared pointer
constexpr ByteCount bytes_of_survey = 64;     // how rough a brick is, without a number for each bound
constexpr ByteCount bytes_of_estimate = 400;  // what the encoding of a brick with one bound gave
constexpr ByteCount bytes_of_range = 64;      // values of a brick that wait for the index, and its entry
constexpr ByteCount bytes_of_entry = 32;      // an entry of the index, in memory and as bytes

// A vector that grows by copying has room for twice its content, and three times while it is copied.
constexpr ByteCount grown = 2, growing = 3;

// Samples are written in parts of this size, or of a row: DecodedRows::part_bytes.
constexpr ByteCount part_of_rows = 1 << 18;

// Columns of tiles on which a brick depends: its own, and those around it.
constexpr ByteCount columns_around = 9;

struct Sizes {
  explicit Sizes(const CodingParameters& p)
      : parameters(p),
        bricks(p.bricks()),
        closed(bricks.closed_box(largest)),
        nx(static_cast<ByteCount>(p.dims.x)),
        s(static_cast<ByteCount>(size_of(p.type))),
        cube(p.cube_size),
        edge(static_cast<ByteCount>(bricks.length())),
        points(count(closed.size())),
        owned(count(bricks.owned_box(largest).size())),
        brick_count(ByteCount(bricks.bricks(0)) * ByteCount(bricks.bricks(1)) * ByteCount(bricks.bricks(2))),
        row_count(ByteCount(bricks.bricks(0))),
        grid(p.mode == FileMode::grid) {}

  static ByteCount count(const Index3& n) { return ByteCount(n.x) * ByteCount(n.y) * ByteCount(n.z); }
  // The bytes of an encoded brick.
  ByteCount code() const { return static_cast<ByteCount>(most_bytes_of_code(parameters, largest)); }
  // The activity of a brick's closed box.
  ByteCount bits() const {
    return static_cast<ByteCount>(LatticeBits::working_bytes(closed.size())) + bytes_of_object;
  }

  // No other brick is larger.
  static constexpr Index3 largest{0, 0, 0};

  const CodingParameters& parameters;
  BrickGrid bricks;
  Box closed;  ///< of the largest brick
  ByteCount nx, s, cube, edge;
  ByteCount points, owned;  ///< of the largest brick
  ByteCount brick_count, row_count;
  bool grid;
};

// The memory of a worker: that of the stage, and the samples gathered for it.
ByteCount work_of_marking(const Sizes& z) {
  Index3 tile = z.closed.size();
  tile.z = z.parameters.cube_size + 1;
  const Index3 read = Box::of_size(tile).grown(mark_halo(z.parameters)).size();
  return Sizes::count(read) * z.s + static_cast<ByteCount>(working_bytes_of_marking(z.parameters, tile));
}

ByteCount work_of_subdividing(const Sizes& z) {
  // Root cubes surround a brick, unless it lies at the border of the domain.
  Index3 position;
  for (int axis = 0; axis < 3; ++axis) position[axis] = z.bricks.bricks(axis) > 2;
  return static_cast<ByteCount>(working_bytes_of_subdivision(z.bricks.closed_box(position), z.bricks.domain));
}

ByteCount work_of_encoding(const Sizes& z) {
  return (z.grid ? z.points : z.owned) * z.s + z.bits() +
         static_cast<ByteCount>(working_bytes_of_encoding(z.parameters, Sizes::largest));
}

ByteCount work_of_decoding(const Sizes& z, Wanted wanted) {
  return static_cast<ByteCount>(working_bytes_of_decoding(z.parameters, Sizes::largest, wanted));
}

ByteCount work_of_measuring(const Sizes& z) {
  if (z.parameters.mesh_error < 0) return 0;
  return z.points * z.s +
         static_cast<ByteCount>(working_bytes_of_mesh_error(z.parameters.type, z.closed.size()));
}
// A brick that waits for measuring: the grid, and the values of the closed box twice.
ByteCount waits_for_measuring(const Sizes& z) {
  return z.parameters.mesh_error < 0 ? 0 : z.bits() + 2 * z.points * z.s;
}
ByteCount closed_faces(const Sizes& z, ByteCount rows) {
  const CodingParameters& p = z.parameters;
  if (!mesh_needs_bricks_below(p)) return 0;
  return static_cast<ByteCount>(ClosedSamples::working_bytes(p, static_cast<std::int64_t>(rows)));
}

std::uint64_t whole(ByteCount bytes) {
  return memory_of_program + static_cast<std::uint64_t>(std::min(bytes * heap_overhead, 9e18));
}

// Bricks of a page of the index, as far as there are so many.
ByteCount bricks_of_page(const Sizes& z) {
  const PageLayout layout(static_cast<std::int64_t>(std::min(z.brick_count, 4e18)));
  return std::min(z.brick_count, ByteCount(layout.per_page()));
}
// A page while it is written or read front to back: its entries, their bytes and the packed ones, and for zstd
// ten times as much, but at most its window; and the directory, thrice.
ByteCount index_of_stream(const Sizes& z) {
  const ByteCount page = bricks_of_page(z) * bytes_of_entry;
  return (grown + growing) * page + std::min(10 * page, 40e6) + 3 * ByteCount(largest_directory);
}
// The same for decoding, front to back or by the index.
ByteCount index_of_decoding(const Sizes& z) {
  return std::max(index_of_stream(z), TagPages::memory(z.brick_count));
}

// What a schedule keeps of the grid of some rows of bricks: the marks of root layers, and bricks that wait
// for a thread. `layers_ahead`: root layers that are marked ahead of those that a layer of bricks needs.
ByteCount marks_and_jobs(const Sizes& z, ByteCount rows, bool strips, ByteCount layers_ahead) {
  const CodingParameters& p = z.parameters;
  const bool cropped = !p.bounds_interpolation();
  const ByteCount layers = std::min(p.brick_edge + 3 + layers_ahead, ByteCount(z.bricks.domain.cubes(2)));
  const ByteCount mark_rows =
      std::min(strips ? rows * z.edge + 2 * z.cube + 1 : ByteCount(z.bricks.bricks(1)) * z.edge + 1,
               cropped ? ByteCount(p.dims.y) : 9e18);
  const ByteCount mark_slices = cropped ? std::min(z.cube + 1, ByteCount(p.dims.z)) : z.cube + 1;
  const ByteCount words =
      z.row_count *
          ByteCount((static_cast<std::int64_t>(std::min(z.edge, cropped ? z.nx : 9e18)) + 63) / 64) +
      1;
  const ByteCount tiles = z.row_count * (rows + 2);
  const ByteCount marks =
      layers * (mark_rows * mark_slices * words * 8 + tiles * (bytes_of_tile + bytes_of_job));
  // Bricks of all layers whose marks are there may wait for a thread.
  const ByteCount jobs = std::ceil(layers / p.brick_edge) * tiles *
                         (bytes_of_job + bytes_of_pointer * columns_around * (p.brick_edge + 2));
  return marks + jobs;
}

// A grid derived from decoded samples: slices, marks, and the work of the threads with some bricks each.
ByteCount derived_grid(const Sizes& z, ByteCount threads) {
  const CodingParameters& p = z.parameters;
  const ByteCount slices = std::min(z.edge + z.cube + mark_halo(p) + 2, ByteCount(p.dims.z));
  const ByteCount slice = z.nx * ByteCount(p.dims.y) * z.s + bytes_of_object;
  const ByteCount work = std::max(work_of_marking(z), work_of_subdividing(z)) + 4 * z.bits();
  return slices * slice + marks_and_jobs(z, ByteCount(z.bricks.bricks(1)), false, 0) + threads * work;
}

}  // namespace

std::uint64_t with_heap_overhead(double bytes) {
  return static_cast<std::uint64_t>(std::min(bytes * heap_overhead, 4e18));
}

std::uint64_t memory_of_encoding(const CodingParameters& p, const EncodeLoad& load) {
  const Sizes z(p);
  const bool strips = load.rows < z.bricks.bricks(1), grid = p.counts_points();
  const ByteCount around = grid ? z.cube + mark_halo(p) : 0, ny = ByteCount(p.dims.y),
                  nz = ByteCount(p.dims.z);
  const ByteCount rows = ByteCount(load.rows);

  const ByteCount sample_rows = strips ? std::min(ny, rows * z.edge + 2 * around + 1) : ny;
  const ByteCount slices =
      strips ? z.edge + 2 * around + 1 : z.edge + around + ByteCount(load.slices_ahead) + 2;
  const ByteCount samples = std::min(slices, nz) * (z.nx * sample_rows * z.s + bytes_of_object);

  const ByteCount ahead = strips ? 0 : ByteCount(load.slices_ahead / p.cube_size);
  const ByteCount marks_and_jobs_of_grid = grid ? marks_and_jobs(z, rows, strips, ahead) : 0;
  // Without marks, whole layers wait for threads.
  const ByteCount jobs = grid ? 0 : (ahead / p.brick_edge + 2) * z.row_count * rows * bytes_of_job;

  const ByteCount of_grid = grid ? std::max(work_of_marking(z), work_of_subdividing(z)) : 0;
  const ByteCount work =
      ByteCount(load.threads) * std::max({of_grid, work_of_encoding(z), work_of_measuring(z)});
  const ByteCount flight = ByteCount(load.bricks_in_flight) * (z.code() + z.bits() + waits_for_measuring(z));
  // A stretch of rows has all the samples of its blocks.
  const ByteCount sums =
      load.sums ? static_cast<ByteCount>(SlabSums::memory(
                      layout_of_sums(p.dims, p.type, block_edge), p.dims.x,
                      strips ? std::min(p.dims.y, load.rows * z.bricks.length() + block_edge) : p.dims.y))
                : 0;
  return whole(samples + marks_and_jobs_of_grid + jobs + work + flight + closed_faces(z, rows) + sums +
               index_of_stream(z));
}

std::uint64_t memory_of_decoding(const CodingParameters& p, const DecodeLoad& load) {
  const Sizes z(p);
  const ByteCount rows = ByteCount(load.rows), nz = ByteCount(p.dims.z), ny = ByteCount(p.dims.y);
  const bool makes_values = load.value_bytes > 0;
  const ByteCount s = makes_values ? static_cast<ByteCount>(load.value_bytes) : z.s;
  const ByteCount slice = z.nx * std::min(ny, rows * z.edge + 1) * s;
  const ByteCount gathered = slice * std::min(nz, z.edge + 1) + rows * z.row_count * bytes_of_array;
  const ByteCount pieces = ByteCount(load.threads) * std::max(part_of_rows, z.nx * s);
  // The encoded bytes, the samples, and freed samples that the heap still holds.
  const ByteCount brick =
      z.code() + z.owned * (z.s + s) +
      (load.with_grid && p.stores_activity() ? z.bits() + (z.grid ? z.points * z.s : 0) : 0);
  // While samples become values, both are there.
  const ByteCount work = ByteCount(load.threads) *
                         (work_of_decoding(z, load.with_grid ? Wanted::samples_and_grid : Wanted::samples) +
                          (makes_values ? z.owned * s : 0));
  // The reader has a brick as read and as parsed, the one before it, and one more that the heap still holds.
  const ByteCount flight = ByteCount(load.bricks_in_flight) * brick + 4 * z.code();
  ByteCount inspection = 0;
  if (load.inspect) {
    // Each brick of a layer leaves three faces. Rows of bits are whole words, so faces along x have more.
    const ByteCount layer = z.row_count * ByteCount(z.bricks.bricks(1)), face = 2 * z.bits() / z.edge;
    const ByteCount face_points = z.grid ? (z.edge + 1) * (z.edge + 1) * z.s : 0;
    const ByteCount original_and_decoded = 2 * slice;
    inspection = layer * 3 * (face + face_points + bytes_of_face) +
                 (bricks_of_page(z) + ByteCount(load.bricks_in_flight)) * grown * bytes_of_range +
                 original_and_decoded;
    if (p.surface_error >= 0) inspection += rows * z.row_count * z.bits();
    // Bricks wait for the original samples of their layer.
    if (p.mesh_error >= 0)
      inspection += rows * z.row_count * waits_for_measuring(z) + slice * std::min(nz, z.edge + 1) +
                    ByteCount(load.threads) * work_of_measuring(z) + closed_faces(z, rows);
  }
  const bool derives = load.with_grid && !p.stores_activity();
  const ByteCount grid = derives ? derived_grid(z, ByteCount(load.threads)) : 0;
  return whole(gathered + pieces + work + flight + inspection + grid + index_of_decoding(z));
}

std::uint64_t memory_of_deriving(const CodingParameters& p, std::int64_t threads) {
  return with_heap_overhead(derived_grid(Sizes(p), ByteCount(threads)));
}

std::uint64_t memory_of_reading(const CodingParameters& p, std::int64_t threads, bool with_grid) {
  const Sizes z(p);
  // The block of the brick, as read and as parsed, and the freed memory of the brick before it.
  const ByteCount brick = 2 * z.code() + z.owned * z.s +
                          work_of_decoding(z, with_grid ? Wanted::samples_and_grid : Wanted::samples);
  return whole(ByteCount(threads) * brick + index_of_decoding(z));
}

std::uint64_t memory_of_estimating(const CodingParameters& p, std::int64_t threads, std::int64_t bounds,
                                   std::int64_t chosen) {
  const Sizes z(p);
  const ByteCount edge = z.edge + 2 * z.cube + 1, halo = mark_halo(p), rows = edge + 2 * halo;
  const ByteCount slices =
      z.nx * std::min(rows, ByteCount(p.dims.y)) * std::min(rows, ByteCount(p.dims.z)) * z.s;
  const auto region = static_cast<std::int64_t>(edge);
  const ByteCount marking = rows * rows * rows * z.s +
                            static_cast<ByteCount>(working_bytes_of_marking(p, {region, region, region}));
  const ByteCount coding =
      2 * z.owned * z.s + z.code() + std::max(work_of_encoding(z), work_of_decoding(z, Wanted::samples));
  const ByteCount work = std::max({marking, work_of_subdividing(z), coding}) + z.bits();
  const ByteCount looked_at = z.brick_count * growing * (bytes_of_survey + 8 * ByteCount(bounds)),
                  encoded = ByteCount(chosen) * ByteCount(bounds) * bytes_of_estimate;
  return whole(slices + ByteCount(threads) * (slices + work) + looked_at + encoded);
}

}  // namespace tagrid
