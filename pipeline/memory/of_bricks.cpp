#include "pipeline/memory/of_bricks.h"

#include <algorithm>

#include "stages/brick/closed_samples.h"
#include "stages/brick/codec.h"
#include "stages/brick/decode.h"
#include "stages/grid/lattice_bits.h"
#include "stages/marks/halo.h"
#include "stages/marks/subdivide.h"
#include "stages/marks/tile.h"
#include "stages/mesh/mesh_error.h"
#include "stages/points/field.h"

namespace tagrid {
namespace {

// For a hostile header, sums over all bricks need more than 64 bits. The memory of one brick does not.
using ByteCount = double;

struct Sizes {
  explicit Sizes(const CodingParameters& p)
      : parameters(p),
        bricks(p.bricks()),
        closed(bricks.closed_box(largest)),
        nx(static_cast<ByteCount>(p.dims.x)),
        s(static_cast<ByteCount>(size_of(p.type))),
        cube(p.cube_size),
        edge(ByteCount{1} * p.brick_edge * p.cube_size),
        points(count(closed.size())),
        owned(count(bricks.owned_box(largest).size())),
        brick_count(ByteCount(bricks.bricks(0)) * ByteCount(bricks.bricks(1)) * ByteCount(bricks.bricks(2))),
        row_count(ByteCount(bricks.bricks(0))),
        grid(p.mode == FileMode::grid) {}

  static ByteCount count(const Index3& n) { return ByteCount(n.x) * ByteCount(n.y) * ByteCount(n.z); }
  // The bytes of an encoded brick.
  ByteCount code() const { return static_cast<ByteCount>(most_bytes_of_code(parameters, largest)); }
  // The activity of a brick's closed box.
  ByteCount bits() const { return static_cast<ByteCount>(LatticeBits::working_bytes(closed.size())) + 128; }

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
  // A heap loses a little memory between its blocks.
  return memory_of_program + static_cast<std::uint64_t>(std::min(bytes * 1.03, 9e18));
}

}  // namespace

std::uint64_t memory_of_encoding(const CodingParameters& p, const EncodeLoad& load) {
  const Sizes z(p);
  const ByteCount halo = mark_halo(p), around = z.cube + halo, ny = ByteCount(p.dims.y),
                  nz = ByteCount(p.dims.z);
  const bool strips = load.rows < z.bricks.bricks(1), cropped = !p.bounds_interpolation();
  const ByteCount rows = ByteCount(load.rows);

  const ByteCount sample_rows = strips ? std::min(ny, rows * z.edge + 2 * around + 1) : ny;
  const ByteCount slices =
      strips ? z.edge + 2 * around + 1 : z.edge + around + ByteCount(load.slices_ahead) + 2;
  const ByteCount samples = std::min(slices, nz) * (z.nx * sample_rows * z.s + 128);

  const ByteCount layers =
      std::min(p.brick_edge + 3 + (strips ? 0 : ByteCount(load.slices_ahead) / z.cube + 1),
               ByteCount(z.bricks.domain.cubes(2)));
  const ByteCount mark_rows =
      std::min(strips ? rows * z.edge + 2 * z.cube + 1 : ByteCount(z.bricks.bricks(1)) * z.edge + 1,
               cropped ? ny : 9e18);
  const ByteCount mark_slices = cropped ? std::min(z.cube + 1, nz) : z.cube + 1;
  const ByteCount words =
      z.row_count *
          ByteCount((static_cast<std::int64_t>(std::min(z.edge, cropped ? z.nx : 9e18)) + 63) / 64) +
      1;
  const ByteCount tiles = z.row_count * (rows + 2);
  const ByteCount marks = layers * (mark_rows * mark_slices * words * 8 + tiles * 250);
  const ByteCount jobs = tiles * (350 + 16.0 * 9 * (p.brick_edge + 2));

  const ByteCount work = ByteCount(load.threads) * std::max({work_of_marking(z), work_of_subdividing(z),
                                                             work_of_encoding(z), work_of_measuring(z)});
  const ByteCount flight = ByteCount(load.bricks_in_flight) * (z.code() + z.bits() + waits_for_measuring(z));
  const ByteCount run = samples + marks + jobs + work + flight + closed_faces(z, rows) + 64 * z.brick_count;
  // The index, its fields, and the memory for compressing them.
  const ByteCount end = z.brick_count * 160 + std::min(z.brick_count * 320, 40e6);
  return whole(std::max(run, end));
}

std::uint64_t memory_of_decoding(const CodingParameters& p, const DecodeLoad& load) {
  const Sizes z(p);
  const ByteCount rows = ByteCount(load.rows), nz = ByteCount(p.dims.z), ny = ByteCount(p.dims.y);
  const ByteCount slice = z.nx * std::min(ny, rows * z.edge + 1) * z.s;
  const ByteCount gathered = slice * std::min(nz, z.edge + 1) + rows * z.row_count * 64;
  const ByteCount pieces = 2 * std::max(ByteCount{1 << 20}, z.nx * z.s);
  // The encoded bytes, the samples, and freed samples that the heap still holds.
  const bool keeps_grid = load.inspect || load.mesh;
  const ByteCount brick =
      z.code() + 2 * z.owned * z.s + (keeps_grid ? z.bits() + (z.grid ? z.points * z.s : 0) : 0);
  const ByteCount work =
      ByteCount(load.threads) * work_of_decoding(z, keeps_grid ? Wanted::samples_and_grid : Wanted::samples);
  const ByteCount flight = ByteCount(load.bricks_in_flight) * brick + 4 * z.code();
  ByteCount inspection = 0;
  if (load.inspect) {
    const ByteCount layer = z.row_count * ByteCount(z.bricks.bricks(1)), face = z.bits() / z.edge;
    const ByteCount face_points = z.grid ? (z.edge + 1) * (z.edge + 1) * z.s : 0;
    inspection = layer * 3 * (face * 2 + face_points + 250) + z.brick_count * 32 + 2 * slice;
    if (p.surface_error >= 0) inspection += rows * z.row_count * z.bits();
    // Bricks wait for the original samples of their layer.
    if (p.mesh_error >= 0)
      inspection += rows * z.row_count * waits_for_measuring(z) + slice * std::min(nz, z.edge + 1) +
                    ByteCount(load.threads) * work_of_measuring(z) + closed_faces(z, rows);
  }
  if (load.mesh) {
    const ByteCount layer = z.row_count * ByteCount(z.bricks.bricks(1));
    inspection = layer * (z.bits() + (z.grid ? z.points * z.s : 0) + 200) + z.points * 8 +
                 (z.nx + z.edge) * (ny + z.edge) * (8 + z.s) + (z.nx + z.edge) * z.edge * 8 + 16e6;
    // The field of one brick at the border, two copies of it as samples, and the grid of the field.
    inspection += z.points * (ByteCount(field_number_bytes(p.type)) + 3 * z.s) + z.bits();
  }
  const ByteCount index = z.brick_count * 130 + std::min(z.brick_count * 32, 128e6);
  return whole(gathered + pieces + work + flight + inspection + index);
}

std::uint64_t memory_of_reading(const CodingParameters& p, std::int64_t threads) {
  const Sizes z(p);
  // The block of the brick, as read and as parsed, and the freed memory of the brick before it.
  const ByteCount brick = 2 * z.code() + z.owned * z.s + work_of_decoding(z, Wanted::samples);
  return whole(ByteCount(threads) * brick);
}

}  // namespace tagrid
