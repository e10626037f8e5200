#include "pipeline/encode_schedule.h"

namespace tagrid {

EncodeSchedule::EncodeSchedule(const CodingParameters& parameters, int mark_halo)
    : bricks_(parameters.bricks()), halo_(mark_halo), root_layers_(bricks_.domain.cubes(2)) {}

Box EncodeSchedule::tile_box(Index3 tile) const {
  Box box = bricks_.closed_box({tile.x, tile.y, 0});
  box.low.z = tile.z * bricks_.domain.cube_size;
  box.high.z = box.low.z + bricks_.domain.cube_size;
  return box;
}

Box EncodeSchedule::mark_box(Index3 tile) const {
  Box box = tile_box(tile);
  const Box padded = bricks_.domain.padded();
  for (int axis = 0; axis < 3; ++axis)
    if (box.high[axis] < padded.high[axis]) --box.high[axis];
  return box;
}

std::int64_t EncodeSchedule::slices_needed() const {
  return slices_in_layer() + bricks_.domain.cube_size + halo_ + 1;
}

std::vector<MarkJob> EncodeSchedule::add_slice(SliceSamples slice) {
  window_.add(std::move(slice));
  std::vector<MarkJob> jobs;
  const std::int64_t s = bricks_.domain.cube_size, last = bricks_.domain.dims.z - 1;
  while (next_root_layer_ < root_layers_) {
    const std::int64_t k = next_root_layer_;
    const std::int64_t low = std::max<std::int64_t>(k * s - halo_, 0),
                       high = std::min((k + 1) * s + halo_, last);
    if (window_.end() <= high) break;
    for (std::int64_t y = 0; y < bricks_.bricks(1); ++y)
      for (std::int64_t x = 0; x < bricks_.bricks(0); ++x)
        jobs.push_back({{x, y, k}, window_.range(low, high)});
    RootLayer layer;
    layer.missing = bricks_.layer_count();
    layer.tiles.resize(static_cast<std::size_t>(layer.missing));
    marks_.emplace(k, std::move(layer));
    ++next_root_layer_;
  }
  return jobs;
}

std::vector<BrickJob> EncodeSchedule::add_marks(MarkedTile tile) {
  RootLayer& layer = marks_.at(tile.tile.z);
  layer.tiles[static_cast<std::size_t>(tile.tile.y * bricks_.bricks(0) + tile.tile.x)] =
      std::move(tile.marks);
  --layer.missing;
  return layers_that_became_ready();
}

std::vector<BrickJob> EncodeSchedule::layers_that_became_ready() {
  std::vector<BrickJob> jobs;
  for (; next_brick_layer_ < bricks_.bricks(2); ++next_brick_layer_) {
    // One root layer above the bricks decides with them.
    const std::int64_t first = next_brick_layer_ * bricks_.edge,
                       last = std::min(first + bricks_.edge, root_layers_ - 1);
    for (std::int64_t k = first; k <= last; ++k)
      if (!marks_.contains(k) || marks_.at(k).missing > 0) return jobs;
    add_layer(next_brick_layer_, jobs);
    const std::int64_t next = first + bricks_.edge;
    marks_.erase(marks_.begin(), marks_.lower_bound(next - 1));
    window_.release_below(next * bricks_.domain.cube_size);
  }
  return jobs;
}

void EncodeSchedule::add_layer(std::int64_t layer, std::vector<BrickJob>& jobs) {
  const std::int64_t nx = bricks_.bricks(0), ny = bricks_.bricks(1);
  for (std::int64_t y = 0; y < ny; ++y)
    for (std::int64_t x = 0; x < nx; ++x) {
      BrickJob job;
      job.brick = {x, y, layer};
      const Box box = intersection(bricks_.closed_box(job.brick), bricks_.domain.volume());
      job.slices = window_.range(box.low.z, box.high.z);
      for (std::int64_t k = layer * bricks_.edge - 1; k <= (layer + 1) * bricks_.edge; ++k) {
        const auto found = marks_.find(k);
        if (found == marks_.end()) continue;
        for (std::int64_t v = std::max<std::int64_t>(y - 1, 0); v <= std::min(y + 1, ny - 1); ++v)
          for (std::int64_t u = std::max<std::int64_t>(x - 1, 0); u <= std::min(x + 1, nx - 1); ++u)
            job.marks.push_back(found->second.tiles[static_cast<std::size_t>(v * nx + u)]);
      }
      jobs.push_back(std::move(job));
    }
}

}  // namespace tagrid
