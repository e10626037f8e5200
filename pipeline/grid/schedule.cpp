#include "pipeline/grid/schedule.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "stages/criterion/marking.h"
#include "stages/criterion/subdivide.h"

namespace tagrid {
namespace {

// The bricks' root cubes, and `more` points on every side as far as the domain reaches.
Box cubes_around(const BrickGrid& bricks, const BrickRows& rows, std::int64_t more) {
  const Box first = bricks.closed_box({0, rows.y_low, rows.z_low}),
            last = bricks.closed_box({bricks.bricks(0) - 1, rows.y_end - 1, rows.z_end - 1});
  return intersection(Box{first.low, last.high}.grown(more), bricks.domain.padded());
}

// What is allocated besides the data themselves: the object, what shares it, and the blocks of the heap.
constexpr double bytes_of_slice = 128;
constexpr double bytes_of_tile = 250;    // marks in the map of root layers
constexpr double bytes_of_job = 700;     // a tile or a brick that waits for a thread, and its message
constexpr double bytes_of_pointer = 16;  // to marks
// Columns of tiles on which a brick depends: its own, and those around it.
constexpr double columns_around = 9;

double count(const Index3& n) {
  return static_cast<double>(n.x) * static_cast<double>(n.y) * static_cast<double>(n.z);
}

}  // namespace

GridSchedule::GridSchedule(const CodingParameters& parameters, const BrickRows& rows,
                           std::optional<int> mark_halo)
    : bricks_(parameters.bricks()),
      rows_(rows),
      marks_(mark_halo.has_value()),
      halo_(mark_halo.value_or(0)),
      marks_outside_(parameters.bounds_interpolation()),
      marked_(cubes_around(bricks_, rows, marks_ ? parameters.cube_size : 0)),
      samples_(intersection(marked_.grown(halo_), bricks_.domain.volume())),
      window_(samples_.low.z, samples_.low.y),
      root_layer_end_(marked_.high.z / bricks_.domain.cube_size),
      next_root_layer_(marked_.low.z / bricks_.domain.cube_size),
      next_brick_layer_(rows.z_low) {}

Box GridSchedule::tile_box(Index3 tile) const {
  Box box = bricks_.closed_box({tile.x, tile.y, 0});
  box.low.z = tile.z * bricks_.domain.cube_size;
  box.high.z = box.low.z + bricks_.domain.cube_size;
  return intersection(box, marked_);
}

Box GridSchedule::mark_box(Index3 tile) const {
  Box box = tile_box(tile);
  const Box padded = bricks_.domain.padded();
  for (int axis = 0; axis < 3; ++axis)
    if (box.high[axis] < padded.high[axis]) --box.high[axis];
  // Outside the volume nothing is curved, so no marks are needed there.
  return marks_outside_ ? box : intersection(box, bricks_.domain.volume());
}

std::int64_t GridSchedule::slices_needed() const {
  // The first layer may have root cubes and a halo below it, or padding; the others begin with a slice.
  const std::int64_t below = std::max<std::int64_t>(rows_.z_low * slices_in_layer() - samples_.low.z, 0);
  const std::int64_t above = marks_ ? bricks_.domain.cube_size + halo_ : 0;
  return below + slices_in_layer() + above + 1;
}

std::int64_t GridSchedule::slices_released_by(std::int64_t layer) const {
  return slices_in_layer() + (layer == rows_.z_low ? layer * slices_in_layer() - samples_.low.z : 0);
}

double GridSchedule::memory(const CodingParameters& p, std::int64_t rows, std::optional<int> mark_halo,
                            std::int64_t slices_ahead) {
  const BrickGrid bricks = p.bricks();
  const auto nx = static_cast<double>(p.dims.x), ny = static_cast<double>(p.dims.y),
             nz = static_cast<double>(p.dims.z), row_count = static_cast<double>(bricks.bricks(0)),
             edge = static_cast<double>(bricks.length()), all = static_cast<double>(rows);
  const double cube = p.cube_size;
  const bool strips = rows < bricks.bricks(1);
  const double around = mark_halo ? cube + *mark_halo : 0;
  const double sample_rows = strips ? std::min(ny, all * edge + 2 * around + 1) : ny;
  const double needed =
      strips ? edge + 2 * around + 1 : edge + around + static_cast<double>(slices_ahead) + 2;
  const double slices =
      std::min(needed, nz) * (nx * sample_rows * static_cast<double>(size_of(p.type)) + bytes_of_slice);
  const auto root_layers_ahead = static_cast<double>(slices_ahead / p.cube_size);
  // Without marks, whole layers wait for threads.
  if (!mark_halo) return slices + (root_layers_ahead / p.brick_edge + 2) * row_count * all * bytes_of_job;

  const bool cropped = !p.bounds_interpolation();
  const double layers =
      std::min(p.brick_edge + 3 + root_layers_ahead, static_cast<double>(bricks.domain.cubes(2)));
  const double mark_rows =
      std::min(strips ? all * edge + 2 * cube + 1 : static_cast<double>(bricks.bricks(1)) * edge + 1,
               cropped ? ny : 9e18);
  const double mark_slices = cropped ? std::min(cube + 1, nz) : cube + 1;
  const double words = row_count * std::ceil(std::min(edge, cropped ? nx : 9e18) / 64) + 1;
  const double tiles = row_count * (all + 2);
  const double marks =
      layers * (mark_rows * mark_slices * words * 8 + tiles * (bytes_of_tile + bytes_of_job));
  // Bricks of all layers whose marks are there may wait for a thread.
  const double jobs = std::ceil(layers / p.brick_edge) * tiles *
                      (bytes_of_job + bytes_of_pointer * columns_around * (p.brick_edge + 2));
  return slices + marks + jobs;
}

GridSchedule::Work GridSchedule::add_slice(SliceSamples slice) {
  window_.add(std::move(slice));
  if (marks_) return {tiles_that_became_ready(), {}};
  return {{}, layers_that_became_ready()};
}

GridSchedule::Work GridSchedule::add_marks(MarkedTile tile) {
  RootLayer& layer = root_layers_.at(tile.tile.z);
  layer.tiles[static_cast<std::size_t>((tile.tile.y - tile_row_low()) * bricks_.bricks(0) + tile.tile.x)] =
      std::move(tile.marks);
  --layer.missing;
  return {{}, layers_that_became_ready()};
}

std::vector<MarkJob> GridSchedule::tiles_that_became_ready() {
  std::vector<MarkJob> jobs;
  const std::int64_t s = bricks_.domain.cube_size, last = samples_.high.z;
  while (next_root_layer_ < root_layer_end_) {
    const std::int64_t k = next_root_layer_;
    const std::int64_t low = std::max(k * s - halo_, samples_.low.z),
                       high = std::min((k + 1) * s + halo_, last);
    if (window_.end() <= high) break;
    const SliceRange slices = window_.range(low, high);
    for (std::int64_t y = tile_row_low(); y < tile_row_end(); ++y)
      for (std::int64_t x = 0; x < bricks_.bricks(0); ++x) jobs.push_back({{x, y, k}, slices});
    RootLayer layer;
    layer.missing = (tile_row_end() - tile_row_low()) * bricks_.bricks(0);
    layer.tiles.resize(static_cast<std::size_t>(layer.missing));
    root_layers_.emplace(k, std::move(layer));
    ++next_root_layer_;
  }
  return jobs;
}

// The bricks also depend on one root layer below and one above.
bool GridSchedule::has_marks(std::int64_t layer) const {
  const std::int64_t first = layer * bricks_.edge, below = std::max<std::int64_t>(first - 1, 0),
                     last = std::min(first + bricks_.edge, root_layer_end_ - 1);
  for (std::int64_t k = below; k <= last; ++k)
    if (!root_layers_.contains(k) || root_layers_.at(k).missing > 0) return false;
  return true;
}

std::vector<BrickJob> GridSchedule::layers_that_became_ready() {
  std::vector<BrickJob> jobs;
  for (; next_brick_layer_ < rows_.z_end; ++next_brick_layer_) {
    const Box layer = bricks_.closed_box({0, 0, next_brick_layer_});
    if (marks_ ? !has_marks(next_brick_layer_) : window_.end() <= std::min(layer.high.z, samples_.high.z))
      break;
    add_layer(next_brick_layer_, jobs);
    const std::int64_t next = (next_brick_layer_ + 1) * bricks_.edge;
    root_layers_.erase(root_layers_.begin(), root_layers_.lower_bound(next - 1));
    window_.release_below(next * bricks_.domain.cube_size);
  }
  return jobs;
}

void GridSchedule::add_layer(std::int64_t layer, std::vector<BrickJob>& jobs) {
  const std::int64_t nx = bricks_.bricks(0);
  const Box layer_box = intersection(bricks_.closed_box({0, 0, layer}), bricks_.domain.volume());
  const SliceRange slices = window_.range(layer_box.low.z, layer_box.high.z);
  for (std::int64_t y = rows_.y_low; y < rows_.y_end; ++y)
    for (std::int64_t x = 0; x < nx; ++x) {
      BrickJob job;
      job.brick = {x, y, layer};
      job.slices = slices;
      for (std::int64_t k = layer * bricks_.edge - 1; k <= (layer + 1) * bricks_.edge; ++k) {
        const auto found = root_layers_.find(k);
        if (found == root_layers_.end()) continue;
        for (std::int64_t v = std::max(y - 1, tile_row_low()); v < std::min(y + 2, tile_row_end()); ++v)
          for (std::int64_t u = std::max<std::int64_t>(x - 1, 0); u <= std::min(x + 1, nx - 1); ++u)
            job.marks.push_back(found->second.tiles[static_cast<std::size_t>((v - tile_row_low()) * nx + u)]);
      }
      jobs.push_back(std::move(job));
    }
}

MarkedTile mark(const MarkJob& job, const CodingParameters& parameters, const GridSchedule& schedule) {
  const Box cubes = schedule.tile_box(job.tile);
  const BrickSamples samples =
      gather(job.slices, parameters.domain().volume(), parameters.type, cubes.grown(mark_halo(parameters)));
  return {job.tile,
          std::make_shared<LatticeBits>(mark_tile(samples, cubes, schedule.mark_box(job.tile), parameters))};
}

SubdividedBrick subdivide(const BrickJob& job, const CodingParameters& parameters) {
  if (job.marks.empty()) return {job.brick, job.slices, {}};
  const Domain domain = parameters.domain();
  const Box box = parameters.bricks().closed_box(job.brick);
  LatticeBits marks(region_of_marks(box, domain));
  for (const auto& tile : job.marks) copy_bits(*tile, marks);
  return {job.brick, job.slices, subdivide(std::move(marks), box, domain)};
}

double memory_of_activity(const CodingParameters& p) {
  constexpr double of_object = 128;
  return static_cast<double>(LatticeBits::working_bytes(p.bricks().closed_box({0, 0, 0}).size())) + of_object;
}

double memory_of_marking(const CodingParameters& p) {
  Index3 tile = p.bricks().closed_box({0, 0, 0}).size();
  tile.z = p.cube_size + 1;
  return count(Box::of_size(tile).grown(mark_halo(p)).size()) * static_cast<double>(size_of(p.type)) +
         static_cast<double>(working_bytes_of_marking(p, tile));
}

double memory_of_subdividing(const CodingParameters& p) {
  // Root cubes surround a brick, unless it lies at the border of the domain.
  const BrickGrid bricks = p.bricks();
  Index3 brick;
  for (int axis = 0; axis < 3; ++axis) brick[axis] = bricks.bricks(axis) > 2;
  return static_cast<double>(working_bytes_of_subdivision(bricks.closed_box(brick), bricks.domain));
}

DerivedGrid::DerivedGrid(const CodingParameters& parameters, const BrickRows& rows, Take take)
    : parameters_(parameters), schedule_(parameters, rows, mark_halo(parameters)), take_(std::move(take)) {}

std::vector<BrickRows> DerivedGrid::stretches() const {
  const BrickGrid bricks = parameters_.bricks();
  const Box& box = samples();
  const BrickRows rows = {bricks.owner(box.low.y), bricks.owner(box.high.y) + 1, bricks.owner(box.low.z),
                          bricks.owner(box.high.z) + 1};
  if (rows.y_low == 0 && rows.y_end == bricks.bricks(1)) return {rows};
  std::vector<BrickRows> layers;
  for (std::int64_t z = rows.z_low; z < rows.z_end; ++z) layers.push_back({rows.y_low, rows.y_end, z, z + 1});
  return layers;
}

void DerivedGrid::add_slice(SliceSamples slice) {
  const std::vector<MarkJob> tiles = schedule_.add_slice(std::move(slice)).tiles;
  std::vector<MarkedTile> marked(tiles.size());
  oneapi::tbb::parallel_for(std::size_t{0}, tiles.size(),
                            [&](std::size_t i) { marked[i] = mark(tiles[i], parameters_, schedule_); });
  for (MarkedTile& tile : marked) subdivide_all(schedule_.add_marks(std::move(tile)).bricks);
}

// A few bricks for each thread at a time: those of a layer may be many.
constexpr int bricks_of_thread = 4;

double DerivedGrid::memory(const CodingParameters& p, std::int64_t threads) {
  const double work =
      std::max(memory_of_marking(p), memory_of_subdividing(p)) + bricks_of_thread * memory_of_activity(p);
  return GridSchedule::memory(p, p.bricks().bricks(1), mark_halo(p), 0) + static_cast<double>(threads) * work;
}

void DerivedGrid::subdivide_all(const std::vector<BrickJob>& jobs) {
  const auto together =
      static_cast<std::size_t>(bricks_of_thread * oneapi::tbb::this_task_arena::max_concurrency());
  for (std::size_t first = 0; first < jobs.size(); first += together) {
    std::vector<SubdividedBrick> bricks(std::min(together, jobs.size() - first));
    oneapi::tbb::parallel_for(std::size_t{0}, bricks.size(),
                              [&](std::size_t i) { bricks[i] = subdivide(jobs[first + i], parameters_); });
    for (const SubdividedBrick& brick : bricks) take_(brick);
  }
}

}  // namespace tagrid
