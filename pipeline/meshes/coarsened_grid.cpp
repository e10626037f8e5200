#include "pipeline/meshes/coarsened_grid.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "pipeline/memory/plan.h"
#include "pipeline/meshes/grid_bricks.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

constexpr int neighbors = 27;  // a brick is in the middle of them
constexpr int opposite(int direction) { return neighbors - 1 - direction; }
constexpr Index3 step_of(int direction) {
  return {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
}

// Calls visit(p) for the points of a box until it returns true.
template <class Visit>
bool any_point_of(const Box& box, Visit visit) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x)
        if (visit(Index3{x, y, z})) return true;
  return false;
}

// Makes the points of both boxes that are active in `from` active in `to`.
void add_shared(const LatticeBits& from, LatticeBits& to) {
  for_each_point_of(intersection(from.box(), to.box()), [&](Index3 p) {
    if (from.test(p)) to.set(p);
  });
}

std::uint64_t largest_brick_samples(const CodingParameters& p) {
  return static_cast<std::uint64_t>(p.bricks().closed_box({0, 0, 0}).count()) * size_of(p.type);
}
std::uint64_t largest_brick_bits(const CodingParameters& p) {
  return LatticeBits::working_bytes(p.bricks().closed_box({0, 0, 0}).size());
}

std::uint64_t bytes_beside_decoding(const CodingParameters& parameters, std::uint64_t taker_bytes,
                                    int threads) {
  return with_heap_overhead(static_cast<double>(CoarsenedGrid::working_bytes(parameters, threads)) +
                            static_cast<double>(CoarsenedGrid::bytes_of_brick(parameters)) +
                            static_cast<double>(taker_bytes));
}

}  // namespace

CoarsenedGrid::CoarsenedGrid(const CodingParameters& parameters, const MeshBound& bound,
                             const std::string& path)
    : parameters_(parameters),
      bound_(bound),
      bricks_(parameters.bricks()),
      all_(Box::of_size({bricks_.bricks(0), bricks_.bricks(1), bricks_.bricks(2)})),
      window_(bricks_.domain.volume().low.z, bricks_.domain.volume().low.y),
      samples_(SpoolFile::beside(path)),
      bits_(SpoolFile::beside(path)) {}

std::uint64_t CoarsenedGrid::bytes_of_brick(const CodingParameters& p) {
  return largest_brick_samples(p) + largest_brick_bits(p);
}

std::uint64_t CoarsenedGrid::working_bytes(const CodingParameters& p, std::int64_t threads) {
  const BrickGrid bricks = p.bricks();
  // The header of a file may be wrong: these products need more than 64 bits.
  const double slice =
      static_cast<double>(p.dims.x) * static_cast<double>(p.dims.y) * static_cast<double>(size_of(p.type)) +
      256;
  const double slices = static_cast<double>(std::min(p.dims.z, bricks.length() + 1));
  // What is new for a brick, in a list that grows; and the bricks of a round.
  const double each = 3 * sizeof(std::uint32_t) + sizeof(std::int64_t);
  const double all = static_cast<double>(bricks.bricks(0)) * static_cast<double>(bricks.bricks(1)) *
                     static_cast<double>(bricks.bricks(2));
  constexpr double buffers = 2 << 20;  // of the two files
  // Samples; what is active, what is known, what is expanded, and what is active in a neighbor.
  const auto work = static_cast<double>(largest_brick_samples(p) + 4 * largest_brick_bits(p) +
                                        working_bytes_of_refining(bricks.closed_box({0, 0, 0}).size()));
  return static_cast<std::uint64_t>(
      std::min(slices * slice + each * all + buffers + static_cast<double>(threads) * work, 4e18));
}

void CoarsenedGrid::add_layer(const DecodedRows& layer) {
  const Box volume = bricks_.domain.volume();
  layer.for_each_slice(volume, [&](SliceSamples slice) { window_.add(std::move(slice)); });
  const std::int64_t first = next_layer_ * bricks_.layer_count();
  const Box box = intersection(box_of(first), volume);
  const SliceRange slices = window_.range(box.low.z, box.high.z);
  // Bricks of the next layer may hear of points before they come.
  news_.resize(static_cast<std::size_t>(std::min(first + 2 * bricks_.layer_count(), bricks_.count())));
  oneapi::tbb::parallel_for(std::int64_t{0}, bricks_.layer_count(),
                            [&](std::int64_t i) { add_brick(first + i, slices); });
  window_.release_below(box.high.z);
  ++next_layer_;
}

void CoarsenedGrid::add_brick(std::int64_t id, const SliceRange& slices) {
  const Samples samples = gather(slices, bricks_.domain.volume(), parameters_.type, box_of(id)).bytes;
  LatticeBits active(box_of(id));
  set_root_corners(active, parameters_.cube_size);
  {
    const std::scoped_lock lock(mutex_);
    samples_.write_at(static_cast<std::uint64_t>(id) * largest_brick_samples(parameters_), samples);
    active = with_news(id, std::move(active));
  }
  refine(id, samples, {}, std::move(active));
}

void CoarsenedGrid::settle() {
  std::vector<std::int64_t> ids;
  for (;;) {
    ids.clear();
    for (std::size_t id = 0; id < news_.size(); ++id)
      if (news_[id] != 0) ids.push_back(static_cast<std::int64_t>(id));
    if (ids.empty()) return;
    oneapi::tbb::parallel_for(std::size_t{0}, ids.size(), [&](std::size_t i) { refine_again(ids[i]); });
  }
}

void CoarsenedGrid::refine_again(std::int64_t id) {
  LatticeBits before, active;
  Samples samples;
  {
    const std::scoped_lock lock(mutex_);
    before = read_bits(id);
    active = with_news(id, before);
    if (active == before) return;
    samples.resize(static_cast<std::size_t>(box_of(id).count()) * size_of(parameters_.type));
    samples_.read_at(static_cast<std::uint64_t>(id) * largest_brick_samples(parameters_), samples);
  }
  refine(id, samples, std::move(before), std::move(active));
}

// Adds the points that neighbors have announced. REQUIRES: the mutex is locked.
LatticeBits CoarsenedGrid::with_news(std::int64_t id, LatticeBits active) {
  const std::uint32_t news = std::exchange(news_[static_cast<std::size_t>(id)], 0);
  for (int direction = 0; direction < neighbors; ++direction)
    if (news >> direction & 1)
      add_shared(read_bits(bricks_.id(bricks_.position(id) + step_of(direction))), active);
  return active;
}

void CoarsenedGrid::refine(std::int64_t id, const Samples& samples, LatticeBits expanded,
                           LatticeBits active) {
  const LatticeBits known = active;
  refine_to_bound(parameters_.type, samples, bound_, std::move(expanded), active);
  const std::uint32_t directions = concerned(id, known, active);
  const std::scoped_lock lock(mutex_);
  write_bits(id, active);
  for (int direction = 0; direction < neighbors; ++direction)
    if (directions >> direction & 1) {
      const Index3 other = bricks_.position(id) + step_of(direction);
      news_[static_cast<std::size_t>(bricks_.id(other))] |= std::uint32_t{1} << opposite(direction);
    }
}

// The directions of the neighbors that contain a new point. One from a neighbor is not new to the others.
std::uint32_t CoarsenedGrid::concerned(std::int64_t id, const LatticeBits& known,
                                       const LatticeBits& active) const {
  const Index3 position = bricks_.position(id);
  std::uint32_t directions = 0;
  for (int direction = 0; direction < neighbors; ++direction) {
    const Index3 other = position + step_of(direction);
    if (other == position || !all_.contains(other)) continue;
    const Box shared = intersection(active.box(), bricks_.closed_box(other));
    if (any_point_of(shared, [&](Index3 p) { return active.test(p) && !known.test(p); }))
      directions |= std::uint32_t{1} << direction;
  }
  return directions;
}

CoarsenedBrick CoarsenedGrid::brick(Index3 position) {
  const std::int64_t id = bricks_.id(position);
  CoarsenedBrick brick{read_bits(id),
                       Samples(static_cast<std::size_t>(box_of(id).count()) * size_of(parameters_.type))};
  samples_.read_at(static_cast<std::uint64_t>(id) * largest_brick_samples(parameters_), brick.samples);
  return brick;
}

LatticeBits CoarsenedGrid::read_bits(std::int64_t id) {
  LatticeBits bits(box_of(id));
  bits_.read_at(static_cast<std::uint64_t>(id) * largest_brick_bits(parameters_),
                std::as_writable_bytes(bits.words()));
  return bits;
}

void CoarsenedGrid::write_bits(std::int64_t id, const LatticeBits& bits) {
  bits_.write_at(static_cast<std::uint64_t>(id) * largest_brick_bits(parameters_),
                 std::as_bytes(bits.words()));
}

CoarseningPlan plan_coarsening(const CodingParameters& parameters, std::uint64_t taker_bytes,
                               const Resources& resources) {
  const std::uint64_t least = bytes_beside_decoding(parameters, taker_bytes, 1);
  CoarseningPlan plan{plan_decoding(parameters, resources, DecodeUse::mesh, least), resources.threads};
  if (!resources.memory) return plan;
  const std::uint64_t decoding = plan.decoding.memory - least;
  while (plan.threads > 1 &&
         decoding + bytes_beside_decoding(parameters, taker_bytes, plan.threads) > *resources.memory)
    --plan.threads;
  plan.decoding.memory = decoding + bytes_beside_decoding(parameters, taker_bytes, plan.threads);
  return plan;
}

void coarsen_file(TagReader& reader, const MeshBound& bound, const Box& positions, const std::string& path,
                  std::uint64_t taker_bytes, const Resources& resources, const TakeCoarsened& take,
                  const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const CoarseningPlan plan = plan_coarsening(parameters, taker_bytes, resources);
  const BrickGrid bricks = parameters.bricks();
  // Half of the work is done when all samples are decoded.
  const std::uint64_t bytes =
      static_cast<std::uint64_t>(parameters.domain().volume().count()) * size_of(parameters.type);
  ProgressWatch watch(progress, 2 * bytes);
  Threads threads(plan.threads);
  CoarsenedGrid grid(parameters, bound, path);
  RowsTo sink([&](const DecodedRows& layer) { threads.run([&] { grid.add_layer(layer); }); });
  decode({parameters, plan.decoding.budget, BrickRows::all(bricks)}, reader, sink, watch);
  threads.run([&] { grid.settle(); });

  std::uint64_t left = bytes;
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 position = bricks.position(id);
    if (!positions.contains(position)) continue;
    const CoarsenedBrick brick = grid.brick(position);
    const Box& box = brick.active.box();
    take(position, brick.active, [&](Index3 p) {
      return brick.samples.data() + static_cast<std::size_t>(box.offset(p)) * size_of(parameters.type);
    });
    const auto done =
        static_cast<std::uint64_t>(bricks.owned_box(position).count()) * size_of(parameters.type);
    watch.done(done);
    left -= done;
  }
  watch.done(left);
}

}  // namespace tagrid
