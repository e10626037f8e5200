// Coarsening takes no more memory than its plan says, whatever the height of the volume.
#include <gtest/gtest.h>

#include "pipeline/memory/of_bricks.h"
#include "pipeline/meshes/coarsen_file.h"
#include "tests/support/counted_heap.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class CoarseningMemory : public TemporaryFolder {
 protected:
  void SetUp() override {
    if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  }
  void encode(Index3 dims, int cube_size) const {
    write_nrrd(path("in.nrrd"), dims, blobs<std::int16_t>(dims, 2, 60));
    EncodeOptions options;
    options.cube_size = cube_size;
    encode_volume(path("in.nrrd"), {}, path("in.tag"), true, options, Resources(1));
  }
  // The peak of the heap, and what the plan says.
  std::pair<std::uint64_t, std::uint64_t> coarsen(int threads) const {
    TagReader reader(path("in.tag"));
    const CodingParameters& p = reader.parameters();
    const BrickGrid bricks = p.bricks();
    Resources resources(threads);
    resources.memory = std::uint64_t{1} << 32;
    const CoarseningPlan plan = plan_coarsening(p, 0, resources);
    EXPECT_EQ(plan.threads, threads);
    std::int64_t active = 0;
    const HeapPeak peak;
    coarsen_file(reader, {p.dims, p.cube_size, 20, false},
                 Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)}), path("x"), 0,
                 resources, [&](Index3, const LatticeBits& bits, const auto&) {
                   for (const std::uint64_t word : bits.words()) active += std::popcount(word);
                 });
    EXPECT_GT(active, 20000);
    return {peak.bytes(), plan.decoding.memory - memory_of_program};
  }
};

TEST_F(CoarseningMemory, IsWithinThePlan) {
  for (const int cube_size : {8, 32}) {
    encode({70, 60, 90}, cube_size);
    for (const int threads : {1, 3}) {
      const auto [peak, stated] = coarsen(threads);
      EXPECT_LE(peak, stated) << cube_size << ", " << threads;
    }
  }
}

TEST_F(CoarseningMemory, DoesNotGrowWithTheHeight) {
  encode({24, 24, 900}, 8);
  const std::uint64_t low = coarsen(1).first;
  encode({24, 24, 2700}, 8);
  EXPECT_LT(coarsen(1).first, low + low / 4);
}

TEST_F(CoarseningMemory, ATightLimitMeansFewerThreads) {
  encode({70, 60, 90}, 32);
  const TagReader reader(path("in.tag"));
  Resources resources(8);
  resources.memory = std::uint64_t{1} << 32;
  resources.memory = plan_coarsening(reader.parameters(), 0, resources).decoding.memory;
  EXPECT_EQ(plan_coarsening(reader.parameters(), 0, resources).threads, 8);
  Resources one(1);
  one.memory = resources.memory;
  resources.memory = plan_coarsening(reader.parameters(), 0, one).decoding.memory;
  const CoarseningPlan plan = plan_coarsening(reader.parameters(), 0, resources);
  EXPECT_LT(plan.threads, 8);
  EXPECT_LE(plan.decoding.memory, *resources.memory);
}

}  // namespace
}  // namespace tagrid
