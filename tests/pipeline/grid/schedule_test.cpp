#include "pipeline/grid/schedule.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <set>

#include "stages/criterion/subdivide.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

struct Case {
  Index3 dims;
  int cube_size, brick_edge;
  std::optional<int> halo;  // none: no marks
  int lead = 0;
};

const Case cases[] = {{{1, 1, 1}, 4, 1, 1},       {{9, 9, 9}, 4, 1, 1},       {{10, 5, 30}, 4, 2, 1},
                      {{10, 5, 33}, 4, 3, 2},     {{17, 17, 17}, 8, 2, 4},    {{40, 3, 65}, 8, 2, 1},
                      {{40, 30, 66}, 8, 3, 4},    {{33, 65, 129}, 32, 2, 16}, {{64, 64, 1}, 32, 2, 1},
                      {{5, 5, 100}, 32, 1, 16},   {{10, 5, 33}, 4, 3, {}},    {{40, 30, 66}, 8, 2, {}},
                      {{5, 5, 1}, 8, 1, {}},      {{10, 5, 33}, 4, 3, 2, 1},  {{40, 3, 65}, 8, 2, 1, 1},
                      {{64, 64, 64}, 8, 2, 4, 1}, {{5, 5, 1}, 8, 1, {}, 1},   {{40, 30, 66}, 8, 2, {}, 1}};

CodingParameters parameters_of(const Case& c) {
  CodingParameters p{.dims = c.dims, .cube_size = c.cube_size, .brick_edge = c.brick_edge, .lead = c.lead};
  return p;
}

/// All rows; each single one; each two of a layer; each two layers.
std::vector<BrickRows> stretches(const BrickGrid& bricks) {
  const std::int64_t ny = bricks.bricks(1), nz = bricks.bricks(2);
  std::vector<BrickRows> result = {BrickRows::all(bricks)};
  for (std::int64_t z = 0; z < nz; ++z) {
    if (z + 2 <= nz) result.push_back({0, ny, z, z + 2});
    for (std::int64_t y = 0; y < ny; ++y)
      for (std::int64_t rows = 1; rows <= 2 && y + rows <= ny; ++rows)
        result.push_back({y, y + rows, z, z + 1});
  }
  return result;
}

class Playthrough {
 public:
  Playthrough(const Case& c, const BrickRows& rows, unsigned seed)
      : parameters_(parameters_of(c)),
        rows_(rows),
        has_marks_(c.halo),
        schedule_(parameters_, rows, c.halo),
        random_(seed),
        next_brick_(rows.first_brick(parameters_.bricks())) {}

  // Feeds the schedule as the graph does, finished tiles in random order, until nothing is left to do. Without marks,
  // bricks follow from slices alone.
  void play() {
    for (std::int64_t z = schedule_.samples().low.z; z <= schedule_.samples().high.z; ++z) {
      auto slice = std::make_shared<std::byte[]>(1);
      alive_.emplace_back(slice);
      const GridSchedule::Work work = schedule_.add_slice(slice);
      for (const BrickJob& brick : work.bricks) check(brick);
      for (const MarkJob& job : work.tiles) {
        EXPECT_TRUE(tiles_.insert({job.tile.z, job.tile.y, job.tile.x}).second) << "a tile is marked twice";
        waiting_.push_back(job);
      }
      slice.reset();
      if (random_() % 2 == 0) finish_tiles();
      most_alive_ = std::max(most_alive_, count_alive());
    }
    while (!waiting_.empty()) finish_tiles();
  }

  void finish_tiles() {
    std::shuffle(waiting_.begin(), waiting_.end(), random_);
    while (!waiting_.empty()) {
      const MarkJob job = waiting_.back();
      waiting_.pop_back();
      const auto marks = std::make_shared<LatticeBits>(schedule_.mark_box(job.tile));
      const GridSchedule::Work work = schedule_.add_marks({job.tile, marks});
      EXPECT_TRUE(work.tiles.empty());
      for (const BrickJob& brick : work.bricks) check(brick);
    }
  }

  void check(const BrickJob& job) {
    const BrickGrid bricks = parameters_.bricks();
    EXPECT_EQ(bricks.id(job.brick), next_brick_++) << "bricks are not in order";
    const Box samples = intersection(bricks.closed_box(job.brick), parameters_.domain().volume());
    EXPECT_TRUE(schedule_.samples().contains(samples));
    EXPECT_EQ(job.slices.first_row, schedule_.samples().low.y);
    EXPECT_EQ(job.slices.first, samples.low.z);
    EXPECT_EQ(static_cast<std::int64_t>(job.slices.slices->size()), samples.size().z);
    if (has_marks_)
      check_marks(job);
    else
      EXPECT_TRUE(job.marks.empty());
  }

  void check_marks(const BrickJob& job) const {
    const BrickGrid bricks = parameters_.bricks();
    // The marks cover all points on which the activity can depend: they reach S - 2 far. Only the mesh
    // criterion marks points outside the volume.
    const Box closed = bricks.closed_box(job.brick), region = region_of_marks(closed, parameters_.domain());
    Box needed = intersection(closed.grown(parameters_.cube_size - 2), region);
    if (parameters_.mesh_error < 0) needed = intersection(needed, parameters_.domain().volume());
    LatticeBits covered(region);
    for (const auto& tile : job.marks) {
      LatticeBits all(tile->box());
      for (auto& word : all.words()) word = ~std::uint64_t{0};
      copy_bits(all, covered);
    }
    for (const auto [x, y, z] : points_of(needed)) ASSERT_TRUE(covered.test({x, y, z}));
  }

  std::int64_t count_alive() const {
    return std::count_if(alive_.begin(), alive_.end(), [](const auto& slice) { return !slice.expired(); });
  }

  CodingParameters parameters_;
  BrickRows rows_;
  bool has_marks_;
  GridSchedule schedule_;
  std::mt19937 random_;
  std::vector<MarkJob> waiting_;
  std::set<std::array<std::int64_t, 3>> tiles_;
  std::vector<std::weak_ptr<std::byte[]>> alive_;
  std::int64_t next_brick_, most_alive_ = 0;
};

TEST(GridSchedule, EveryTileAndEveryBrickOnceInOrderWithAllItsMarks) {
  for (const Case& c : cases)
    for (const BrickRows& rows : stretches(parameters_of(c).bricks()))
      for (unsigned seed = 0; seed < 5; ++seed) {
        const BrickGrid bricks = parameters_of(c).bricks();
        Playthrough run(c, rows, seed);
        run.play();
        EXPECT_EQ(run.next_brick_, rows.first_brick(bricks) + rows.count(bricks));
        if (rows == BrickRows::all(bricks)) {
          EXPECT_EQ(static_cast<std::int64_t>(run.tiles_.size()),
                    c.halo ? bricks.layer_count() * bricks.domain.cubes(2) : 0);
        }
        EXPECT_LE(run.most_alive_, run.schedule_.samples().size().z);
      }
}

TEST(GridSchedule, EveryMarkHasOneOwner) {
  for (const Case& c : cases) {
    for (const double mesh_error : {-1.0, 1.0}) {
      CodingParameters p = parameters_of(c);
      p.mesh_error = mesh_error;
      const GridSchedule schedule(p, BrickRows::all(p.bricks()), c.halo);
      std::int64_t points = 0;
      for (std::int64_t z = 0; z < p.domain().cubes(2); ++z)
        for (std::int64_t y = 0; y < p.bricks().bricks(1); ++y)
          for (std::int64_t x = 0; x < p.bricks().bricks(0); ++x) {
            EXPECT_TRUE(schedule.tile_box({x, y, z}).contains(schedule.mark_box({x, y, z})));
            points += schedule.mark_box({x, y, z}).count();
          }
      // Without the mesh criterion, no point outside the volume is marked.
      EXPECT_EQ(points, (mesh_error < 0 ? p.domain().volume() : p.domain().padded()).count());
    }
  }
}

// The law behind the limit on slices in flight: with slices_needed() slices of a layer, some work is always
// possible, and the slices that a finished layer releases are enough for the next one.
TEST(GridSchedule, TheSlicesThatItAsksForAreEnoughToGoOn) {
  for (const Case& c : cases)
    for (const BrickRows& rows : stretches(parameters_of(c).bricks())) {
      const CodingParameters p = parameters_of(c);
      GridSchedule schedule(p, rows, c.halo);
      std::int64_t budget = schedule.slices_needed(), read = schedule.samples().low.z, bricks = 0;
      while (bricks < rows.count(p.bricks())) {
        ASSERT_TRUE(budget > 0 && read <= schedule.samples().high.z) << "stuck after " << bricks << " bricks";
        --budget;
        ++read;
        const auto take = [&](const std::vector<BrickJob>& ready) {
          for (const BrickJob& brick : ready) {
            ++bricks;
            if (bricks % rows.layer_count(p.bricks()) == 0)
              budget += schedule.slices_released_by(brick.brick.z);
          }
        };
        const GridSchedule::Work work = schedule.add_slice(std::make_shared<std::byte[]>(1));
        take(work.bricks);
        for (const MarkJob& job : work.tiles)
          take(schedule.add_marks({job.tile, std::make_shared<LatticeBits>(schedule.mark_box(job.tile))})
                   .bricks);
      }
    }
}

TEST(GridSchedule, SlicesAreFreedAsLayersAreDone) {
  const Case tall{{5, 5, 400}, 8, 2, 4};
  Playthrough run(tall, BrickRows::all(parameters_of(tall).bricks()), 1);
  for (std::int64_t z = 0; z < run.parameters_.dims.z; ++z) {
    auto slice = std::make_shared<std::byte[]>(1);
    run.alive_.emplace_back(slice);
    for (const MarkJob& job : run.schedule_.add_slice(slice).tiles) run.waiting_.push_back(job);
    run.finish_tiles();
    slice.reset();
    EXPECT_LE(run.count_alive(), run.schedule_.slices_needed());
  }
}

}  // namespace
}  // namespace tagrid
