// Plans keep the limit that they were made for, and the limit named in a refusal is enough.
#include "pipeline/memory/plan.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "io/errors/errors.h"
#include "pipeline/decode/graph.h"
#include "pipeline/memory/resources.h"
#include "pipeline/verify/verifier.h"
#include "stages/grid/lattice.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

constexpr Index3 shapes[] = {{512, 512, 8000}, {8192, 8192, 150}, {40000, 40000, 1}, {1, 70000, 9000},
                             {1, 1, 100000},   {30, 40, 50},      {3000000, 1, 1},   {1000, 1000, 1000}};

CodingParameters parameters_of(Index3 dims, SampleType type, Effort effort, bool grid) {
  CodingParameters p;
  p.dims = dims;
  p.type = type;
  p.effort = effort;
  p.max_level = max_level(p.cube_size);
  if (grid) p.mode = FileMode::grid;
  if (grid) p.mesh_error = 2;
  return p;
}

Resources limited(int threads, std::uint64_t memory, const std::string& spool = "") {
  Resources resources(threads);
  resources.memory = memory;
  if (!spool.empty()) resources.spool = spool;
  return resources;
}

// The limit that a refusal names as the smallest.
std::uint64_t smallest(const std::function<void(std::uint64_t)>& plan) {
  try {
    plan(1);
  } catch (const MemoryLimit& error) {
    return error.needs().needed;
  }
  ADD_FAILURE() << "one byte was not refused";
  return 0;
}

DecodePlan plan_use(const CodingParameters& p, const Resources& resources, DecodeUse use,
                    std::uint64_t besides = 0) {
  const bool verifies = use == DecodeUse::verify || use == DecodeUse::verify_stream;
  return verifies ? plan_verifying(p, resources, use == DecodeUse::verify, besides)
                  : plan_decoding(p, resources, use, besides);
}

template <class Use>
void for_each_case(Use use) {
  for (const Index3& dims : shapes)
    for (const SampleType type : {SampleType::uint8, SampleType::int16, SampleType::float64})
      for (const Effort effort : {Effort::normal, Effort::best})
        for (const bool grid : {false, true}) use(parameters_of(dims, type, effort, grid));
}

TEST(MemoryPlan, OfEncodingKeepsEveryLimitThatItDoesNotRefuse) {
  for_each_case([](const CodingParameters& p) {
    for (const bool random_access : {false, true}) {
      const std::uint64_t least =
          smallest([&](std::uint64_t limit) { plan_encoding(p, limited(3, limit), random_access); });
      EXPECT_EQ(least, smallest_memory_of_encoding(p, random_access));
      EXPECT_THROW(plan_encoding(p, limited(3, least - 1), random_access), MemoryLimit);
      std::int64_t rows = 0;
      for (const std::uint64_t times : {1, 2, 3, 5, 20, 1000}) {
        const EncodePlan plan = plan_encoding(p, limited(3, least * times), random_access);
        EXPECT_LE(plan.memory, least * times);
        EXPECT_FALSE(plan.spooled);
        EXPECT_TRUE(random_access || !plan.in_strips(p.bricks()));
        if (plan.budget.threads == 3) {
          EXPECT_GE(plan.rows, rows) << "more memory, and less at once";
          rows = plan.rows;
        }
        std::int64_t next = 0;
        for (const BrickRows& strip : plan.strips(p.bricks(), BrickRows::all(p.bricks()))) {
          ASSERT_EQ(strip.first_brick(p.bricks()), next);
          next += strip.count(p.bricks());
        }
        EXPECT_EQ(next, p.bricks().count());
      }
    }
  });
}

TEST(MemoryPlan, OfDecodingKeepsEveryLimitThatItDoesNotRefuse) {
  for_each_case([](const CodingParameters& p) {
    for (const DecodeUse use : {DecodeUse::write, DecodeUse::stream, DecodeUse::verify,
                                DecodeUse::verify_stream, DecodeUse::mesh}) {
      const std::uint64_t least = smallest([&](std::uint64_t limit) { plan_use(p, limited(3, limit), use); });
      for (const std::uint64_t times : {1, 2, 5, 1000}) {
        const DecodePlan plan = plan_use(p, limited(3, least * times), use);
        EXPECT_LE(plan.memory, least * times);
        const bool any_order = use == DecodeUse::write || use == DecodeUse::verify;
        EXPECT_TRUE(any_order || plan.budget.rows == p.bricks().bricks(1));
      }
      EXPECT_NO_THROW(plan_use(p, Resources(3), use)) << "without a limit nothing is refused";
    }
  });
}

TEST(MemoryPlan, ValuesThatAreWiderThanSamplesCount) {
  for_each_case([](const CodingParameters& p) {
    for (const DecodeUse use : {DecodeUse::write, DecodeUse::stream}) {
      const auto least = [&](std::size_t value_bytes) {
        return smallest(
            [&](std::uint64_t limit) { plan_decoding(p, limited(3, limit), use, 0, value_bytes); });
      };
      EXPECT_LE(least(0), least(size_of(p.type)));
      EXPECT_LT(least(size_of(p.type)), least(size_of(p.type) + 4));
    }
  });
}

TEST(MemoryPlan, OfAnEncodingThatIsVerifiedNamesALimitThatIsEnoughForBoth) {
  for_each_case([](const CodingParameters& p) {
    for (const bool any_rows : {false, true})
      for (const std::string spool : {"", "/tmp"}) {
        const Comparing original = {{any_rows, 12345}, smallest_memory_of_verifying};
        const auto both = [&](std::uint64_t limit) {
          return plan_encoding(p, limited(3, limit, spool), any_rows,
                               {.besides = 12345, .verified = original});
        };
        const DecodeUse use = any_rows ? DecodeUse::verify : DecodeUse::verify_stream;
        const auto verify = [&](std::uint64_t limit) { plan_use(p, limited(3, limit, spool), use, 12345); };
        const std::uint64_t least = smallest(both);
        EXPECT_EQ(least, std::max(smallest(verify), smallest([&](std::uint64_t limit) {
                                    plan_encoding(p, limited(3, limit, spool), any_rows, {.besides = 12345});
                                  })));
        EXPECT_THROW(both(least - 1), MemoryLimit);
        EXPECT_LE(both(least).memory, least);
        EXPECT_NO_THROW(verify(least));
      }
    try {
      plan_encoding(p, limited(3, 1), false,
                    {.verified = Comparing{{false, 0}, smallest_memory_of_verifying}});
    } catch (const MemoryLimit& error) {
      if (error.needs().with_spool) {
        EXPECT_NO_THROW(plan_encoding(p, limited(3, *error.needs().with_spool, "/tmp"), false,
                                      {.verified = Comparing{{false, 0}, smallest_memory_of_verifying}}));
      }
    }
  });
}

TEST(MemoryPlan, SpoolsAPipeThatIsTooWideAndNoOther) {
  const CodingParameters wide = parameters_of({8192, 8192, 150}, SampleType::int16, Effort::normal, false);
  const std::uint64_t limit = std::uint64_t{1} << 30;
  EXPECT_THROW(plan_encoding(wide, limited(2, limit), false), UsageError);
  EXPECT_TRUE(plan_encoding(wide, limited(2, limit, "/tmp"), false).spooled);
  EXPECT_FALSE(plan_encoding(wide, limited(2, limit, "/tmp"), true).spooled);
  EXPECT_TRUE(plan_decoding(wide, limited(2, limit, "/tmp"), DecodeUse::stream).spooled);
  const CodingParameters tall = parameters_of({512, 512, 8000}, SampleType::int16, Effort::normal, false);
  EXPECT_FALSE(plan_encoding(tall, limited(2, limit, "/tmp"), false).spooled);
  EXPECT_FALSE(plan_decoding(tall, limited(2, limit, "/tmp"), DecodeUse::stream).spooled);
}

TEST(MemoryPlan, WithoutALimitProcessesShareTheMachine) {
  const CodingParameters wide = parameters_of({8192, 8192, 150}, SampleType::int16, Effort::normal, false);
  Resources resources(1);
  std::uint64_t before = ~std::uint64_t{0};
  for (const int processes : {1, 4, 16}) {
    resources.processes = processes;
    const auto share = available_memory() / static_cast<std::uint64_t>(processes);
    for (const std::uint64_t memory :
         {plan_encoding(wide, resources).memory, plan_decoding(wide, resources).memory})
      EXPECT_LE(memory, share / 2) << processes;
    EXPECT_LE(plan_encoding(wide, resources).memory, before);
    before = plan_encoding(wide, resources).memory;
  }
  resources.processes = 1 << 30;
  EXPECT_THROW(plan_encoding(wide, resources), UsageError);
}

class AvailableMemory : public TemporaryFolder {
 protected:
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(path(name)).parent_path());
    file(name, text);
  }
};

TEST_F(AvailableMemory, IsTheLeastOfTheGroupsThatTheProcessIsIn) {
  const std::uint64_t machine = available_memory(path("nothing"));
  EXPECT_GT(machine, std::uint64_t{1} << 20);
  write("proc/self/cgroup", "0::/a/b\n");
  write("sys/fs/cgroup/a/b/memory.max", "max\n");
  EXPECT_EQ(available_memory(path("")), machine);
  write("sys/fs/cgroup/a/memory.max", "700000\n");
  EXPECT_EQ(available_memory(path("")), 700000U);
  write("sys/fs/cgroup/a/b/memory.max", "600000\n");
  EXPECT_EQ(available_memory(path("")), 600000U);
  write("proc/self/cgroup", "3:cpu,memory:/c/d\n1:cpuset:/\n");
  write("sys/fs/cgroup/memory/c/memory.limit_in_bytes", "500000\n");
  write("sys/fs/cgroup/memory/c/d/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_EQ(available_memory(path("")), 500000U);
}

}  // namespace
}  // namespace tagrid
