#include "pipeline/reading/read_region.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <mutex>
#include <utility>

#include "io/errors/errors.h"
#include "pipeline/decode/graph.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

// The bricks of a file that is read by its index.
class IndexedBricks : public RegionBricks {
 public:
  explicit IndexedBricks(const TagBricks& file) : file_(file) {}
  const std::string& name() const override { return file_.name(); }
  void will_read(std::span<const std::int64_t> bricks) override { file_.will_read(bricks); }
  bool at_once() const override { return true; }
  std::optional<BrickBytes> read(std::int64_t brick) override { return file_.read(brick); }

 private:
  const TagBricks& file_;
};

// One region, read by some threads.
class RegionReader {
 public:
  RegionReader(RegionBricks& bricks, const CodingParameters& parameters, const Region& region,
               const RegionOutput& output, const Progress& progress)
      : bricks_(bricks),
        parameters_(parameters),
        stored_(parameters),
        region_(region),
        output_(output),
        progress_(progress) {
    stored_.type = output.numbers.type(parameters.type);
    const Index3 shape = region.shape();
    total_ = static_cast<std::uint64_t>(shape.x * shape.y * shape.z) * size_of(stored_.type);
  }

  void read(int threads) {
    const std::vector<std::int64_t> ids = bricks_of(region_, parameters_.bricks());
    const auto needed =
        static_cast<int>(std::clamp<std::size_t>(ids.size(), 1, static_cast<std::size_t>(threads)));
    bricks_.will_read(ids);
    auto id = ids.begin();
    Threads(needed).run([&] {
      oneapi::tbb::parallel_for(std::size_t{0}, ids.size(), [&](std::size_t i) {
        if (bricks_.at_once()) return take(bricks_.read(ids[i]));
        std::unique_lock lock(mutex_);
        // A free thread takes the next brick, whatever number it was called with.
        std::optional<BrickBytes> next = bricks_.read(*id);
        ++id;
        lock.unlock();
        take(std::move(next));
      });
    });
  }

 private:
  void take(const std::optional<BrickBytes>& bytes) {
    if (!bytes) return;
    try {
      DecodedBrick brick = decoded(*bytes);
      if (bricks_.accepts(brick)) return store(std::move(brick));
    } catch (const BrokenInput& broken) {
      if (!bricks_.salvages() || is_newer_format(broken)) throw;
    }
    const std::lock_guard lock(mutex_);
    bricks_.lose(bytes->id);
  }

  // No further than the region needs it, unless all of it is judged.
  DecodedBrick decoded(const BrickBytes& bytes) const {
    const BrickGrid bricks = parameters_.bricks();
    const std::int64_t slices =
        bricks_.salvages() ? all_slices : slices_until(region_, bricks.owned_box(bricks.position(bytes.id)));
    return decode_block(bytes, parameters_, bricks_.name(), Wanted::samples, slices);
  }

  void store(DecodedBrick brick) {
    change_brick(output_.numbers, parameters_.bricks(), bricks_.name(), brick);
    const std::uint64_t bytes = copy_samples(brick, stored_, region_, output_.out, output_.strides);
    if (!progress_) return;
    const std::lock_guard lock(mutex_);
    progress_(done_ += bytes, total_);
  }

  RegionBricks& bricks_;
  const CodingParameters& parameters_;
  CodingParameters stored_;  // with the type of what is stored
  const Region& region_;
  const RegionOutput& output_;
  const Progress& progress_;
  std::mutex mutex_;  // of the bricks and the progress
  std::uint64_t total_ = 0, done_ = 0;
};

}  // namespace

int threads_for_reading(const CodingParameters& parameters, const Resources& resources) {
  return threads_within(resources, "reading a part of the volume",
                        [&](int threads) { return memory_of_reading(parameters, threads); });
}

void read_region(RegionBricks& bricks, const CodingParameters& parameters, const Region& region,
                 const RegionOutput& output, int threads, const Progress& progress) {
  assert(parameters.domain().volume().contains(region.box));
  RegionReader(bricks, parameters, region, output, progress).read(threads);
}

void read_region(const TagBricks& file, const Region& region, const RegionOutput& output, int threads,
                 const Progress& progress) {
  IndexedBricks bricks(file);
  read_region(bricks, file.parameters(), region, output, threads, progress);
}

void refuse_region(std::int64_t low, std::int64_t high, int axis, std::int64_t samples) {
  throw UsageError(
      "a region of {}:{} along {}: is empty or reaches beyond the volume, which has {} "
      "samples along {} (0:{})",
      low, high, "xyz"[axis], samples, "xyz"[axis], samples);
}

Region region_of(const WantedRegion& wanted, const CodingParameters& parameters) {
  const Index3& dims = parameters.dims;
  if (!parameters.has_step(wanted.step))
    throw UsageError(
        "a step of {} is not possible: it must be a power of two from 1 to {}, the edge of this "
        "file's root cubes",
        wanted.step, parameters.cube_size);
  Region region;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const std::int64_t low = wanted.low[a].value_or(0), high = wanted.high[a].value_or(dims[axis]);
    if (low < 0 || low >= high || high > dims[axis]) refuse_region(low, high, axis, dims[axis]);
    region.step[axis] = wanted.step;
    region.box.low[axis] = (low + wanted.step - 1) / wanted.step * wanted.step;
    region.box.high[axis] = high - 1;
    if (region.box.low[axis] > region.box.high[axis])
      throw UsageError("a region of {}:{} along {} has no sample whose coordinate is a multiple of {}", low,
                       high, "xyz"[axis], wanted.step);
  }
  region.box = parameters.domain().points_of(region.box);
  return region;
}

}  // namespace tagrid
