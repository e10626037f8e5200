#include "pipeline/memory/of_bricks.h"

#include <algorithm>

#include "stages/marks/halo.h"

namespace tagrid {
namespace {

// Sums of hostile headers need more than 64 bits.
using Bytes = double;

struct Sizes {
  explicit Sizes(const CodingParameters& p)
      : parameters(p),
        bricks(p.bricks()),
        nx(static_cast<Bytes>(p.dims.x)),
        s(static_cast<Bytes>(size_of(p.type))),
        cube(p.cube_size),
        edge(Bytes{1} * p.brick_edge * p.cube_size),
        points(count(bricks.closed_box({0, 0, 0}))),
        owned(count(bricks.owned_box({0, 0, 0}))),
        brick_count(Bytes(bricks.bricks(0)) * Bytes(bricks.bricks(1)) * Bytes(bricks.bricks(2))),
        row_count(Bytes(bricks.bricks(0))),
        grid(p.mode == FileMode::grid) {}

  static Bytes count(const Box& box) {
    const Index3 n = box.size();
    return Bytes(n.x) * Bytes(n.y) * Bytes(n.z);
  }
  // A brick as bytes.
  Bytes code() const { return (grid ? points : owned) * 1.05 * s + 0.2 * points + 1024; }
  // Bits of the points of a brick's closed box, in whole words a row.
  Bytes bits() const {
    const Index3 n = bricks.closed_box({0, 0, 0}).size();
    return Bytes((n.x + 63) / 64) * 8 * Bytes(n.y) * Bytes(n.z) + 128;
  }

  const CodingParameters& parameters;
  BrickGrid bricks;
  Bytes nx, s, cube, edge;
  Bytes points, owned;  ///< of the largest brick
  Bytes brick_count, row_count;
  bool grid;
};

Bytes work_of_marking(const Sizes& z) {
  const bool mesh = z.parameters.bounds_interpolation();
  const Bytes halo = mark_halo(z.parameters);
  const Index3 n = z.bricks.closed_box({0, 0, 0}).size();
  const Bytes samples = (Bytes(n.x) + 2 * halo) * (Bytes(n.y) + 2 * halo) * (z.cube + 1 + 2 * halo);
  const Bytes tile = Bytes(n.x) * Bytes(n.y) * (z.cube + 1);
  return samples * (z.s + (is_wide_type(z.parameters.type) ? 8 : 0)) + tile * (mesh ? 14 : 6);
}

// Coders note every event of a brick before they code them backwards.
Bytes work_of_encoding(const Sizes& z) {
  const bool narrow = !is_wide_type(z.parameters.type);
  const Bytes per_byte = z.grid && narrow ? 96 : z.parameters.effort == Effort::best && narrow ? 112 : 28;
  const Bytes values = per_byte * z.s * (z.grid ? z.points : z.owned);
  return std::max(values, 8 * z.points) + 2 * z.points;
}

Bytes work_of_decoding(const Sizes& z) {
  if (z.grid) return (4 * z.s + 3) * z.points;
  const bool best = z.parameters.effort == Effort::best && !is_wide_type(z.parameters.type);
  return 2.1 * z.s * z.owned + z.points + (best ? 3e6 : 1e5);
}

// The field of a brick, in numbers and as samples, the originals, and what lies in pieces.
Bytes work_of_measuring(const Sizes& z) {
  if (z.parameters.mesh_error < 0) return 0;
  return z.points * ((is_wide_type(z.parameters.type) ? 8 : 4) + 3 * z.s) + 2 * z.bits();
}
// What waits for being measured: the grid, and the values of the closed box twice.
Bytes waits_for_measuring(const Sizes& z) {
  return z.parameters.mesh_error < 0 ? 0 : z.bits() + 2 * z.points * z.s;
}
// See ClosedSamples.
Bytes closed_faces(const Sizes& z, Bytes rows) {
  const CodingParameters& p = z.parameters;
  if (p.mesh_error < 0 || !p.mesh_has_coded_values()) return 0;
  const Bytes face = z.edge + 1;
  return (z.nx * std::min(Bytes(p.dims.y), (rows + 1) * z.edge + 1) + z.nx * face + face * face) * z.s;
}

std::uint64_t whole(Bytes bytes) {
  // Heaps lose a little between what they give.
  return memory_of_program + static_cast<std::uint64_t>(std::min(bytes * 1.03, 9e18));
}

}  // namespace

std::uint64_t memory_of_encoding(const CodingParameters& p, const EncodeLoad& load) {
  const Sizes z(p);
  const Bytes halo = mark_halo(p), around = z.cube + halo, ny = Bytes(p.dims.y), nz = Bytes(p.dims.z);
  const bool strips = load.rows < z.bricks.bricks(1), cropped = !p.bounds_interpolation();
  const Bytes rows = Bytes(load.rows);

  const Bytes sample_rows = strips ? std::min(ny, rows * z.edge + 2 * around + 1) : ny;
  const Bytes slices = strips ? z.edge + 2 * around + 1 : z.edge + around + Bytes(load.slices_ahead) + 2;
  const Bytes samples = std::min(slices, nz) * (z.nx * sample_rows * z.s + 128);

  const Bytes layers = std::min(p.brick_edge + 3 + (strips ? 0 : Bytes(load.slices_ahead) / z.cube + 1),
                                Bytes(z.bricks.domain.cubes(2)));
  const Bytes mark_rows = std::min(
      strips ? rows * z.edge + 2 * z.cube + 1 : Bytes(z.bricks.bricks(1)) * z.edge + 1, cropped ? ny : 9e18);
  const Bytes mark_slices = cropped ? std::min(z.cube + 1, nz) : z.cube + 1;
  const Bytes words =
      z.row_count * Bytes((static_cast<std::int64_t>(std::min(z.edge, cropped ? z.nx : 9e18)) + 63) / 64) + 1;
  const Bytes tiles = z.row_count * (rows + 2);
  const Bytes marks = layers * (mark_rows * mark_slices * words * 8 + tiles * 250);
  const Bytes jobs = tiles * (350 + 16.0 * 9 * (p.brick_edge + 2));

  const Bytes work =
      Bytes(load.threads) * std::max({work_of_marking(z), work_of_encoding(z), work_of_measuring(z)});
  const Bytes flight = Bytes(load.bricks_in_flight) * (z.code() + z.bits() + waits_for_measuring(z));
  const Bytes run = samples + marks + jobs + work + flight + closed_faces(z, rows) + 64 * z.brick_count;
  // The index, its fields, and what compresses them.
  const Bytes end = z.brick_count * 160 + std::min(z.brick_count * 320, 40e6);
  return whole(std::max(run, end));
}

std::uint64_t memory_of_decoding(const CodingParameters& p, const DecodeLoad& load) {
  const Sizes z(p);
  const Bytes rows = Bytes(load.rows), nz = Bytes(p.dims.z), ny = Bytes(p.dims.y);
  const Bytes slice = z.nx * std::min(ny, rows * z.edge + 1) * z.s;
  const Bytes gathered = slice * std::min(nz, z.edge + 1) + rows * z.row_count * 64;
  const Bytes pieces = 2 * std::max(Bytes{1 << 20}, z.nx * z.s);
  const Bytes brick =
      z.code() + 2 * z.owned * z.s + (load.inspect ? z.bits() + (z.grid ? z.points * z.s : 0) : 0);
  const Bytes work = Bytes(load.threads) * (work_of_decoding(z) + (load.inspect ? 2 * z.points : 0));
  const Bytes flight = Bytes(load.bricks_in_flight) * brick + 4 * z.code();
  Bytes inspection = 0;
  if (load.inspect) {
    const Bytes layer = z.row_count * Bytes(z.bricks.bricks(1)), face = z.bits() / z.edge;
    const Bytes face_points = z.grid ? (z.edge + 1) * (z.edge + 1) * z.s : 0;
    inspection = layer * 3 * (face * 2 + face_points + 250) + z.brick_count * 32 + 2 * slice;
    if (p.surface_error >= 0) inspection += rows * z.row_count * z.bits();
    // Bricks wait for the originals of their layer.
    if (p.mesh_error >= 0)
      inspection += rows * z.row_count * waits_for_measuring(z) + slice * std::min(nz, z.edge + 1) +
                    Bytes(load.threads) * work_of_measuring(z) + closed_faces(z, rows);
  }
  if (load.mesh) {
    const Bytes layer = z.row_count * Bytes(z.bricks.bricks(1));
    inspection = layer * (z.bits() + (z.grid ? z.points * z.s : 0) + 200) + z.points * 8 +
                 (z.nx + z.edge) * (ny + z.edge) * (8 + z.s) + (z.nx + z.edge) * z.edge * 8 + 16e6;
    // The field of one brick at the border, in numbers and as samples, and the grid that it is of.
    inspection += z.points * (8 + 3 * z.s) + z.bits();
  }
  const Bytes index = z.brick_count * 130 + std::min(z.brick_count * 32, 128e6);
  return whole(gathered + pieces + work + flight + inspection + index);
}

std::uint64_t memory_of_reading(const CodingParameters& p, std::int64_t threads) {
  const Sizes z(p);
  // The block of the brick, as it is read and taken apart, and the samples of two types.
  const Bytes brick = 2 * z.code() + 2 * z.owned * z.s + work_of_decoding(z);
  return whole(Bytes(threads) * brick);
}

}  // namespace tagrid
