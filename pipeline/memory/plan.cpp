#include "pipeline/memory/plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/errors/errors.h"
#include "io/tag/pages.h"
#include "io/volume/volume_info.h"
#include "pipeline/grid/schedule.h"
#include "stages/brick/closed_samples.h"
#include "stages/brick/codec.h"
#include "stages/criterion/marking.h"
#include "stages/mesh/mesh_error.h"
#include "stages/overview/block_sums.h"

namespace tagrid {
namespace {

// The smallest possible load. Strips need more slices than whole layers, so they may need more memory.
EncodeLoad smallest_encoding(const CodingParameters& p, bool strips, bool sums) {
  // {threads, rows, slices ahead, bricks in flight, sums}
  const EncodeLoad strip = {1, 1, 0, 1, sums}, whole = {1, p.bricks().bricks(1), 0, 1, sums};
  return strips && memory_of_encoding(p, strip) < memory_of_encoding(p, whole) ? strip : whole;
}

// Strips come before fewer threads: they read and mark some rows twice, but fewer threads slow everything.
std::optional<EncodeLoad> best_encoding(const CodingParameters& p, std::int64_t threads, bool strips,
                                        bool sums, std::uint64_t limit) {
  const std::int64_t all = p.bricks().bricks(1), edge = p.bricks().length();
  const auto fits = [&](const EncodeLoad& load) { return memory_of_encoding(p, load) <= limit; };
  for (std::int64_t t = threads; t >= 1; --t) {
    // {threads, rows, slices ahead, bricks in flight, sums}. With one thread, preparing work ahead of time only
    // takes memory.
    const EncodeLoad most = t == 1 ? EncodeLoad{1, all, 4, 1, sums} : EncodeLoad{t, all, edge, 16 * t, sums};
    const EncodeLoad whole[] = {most,
                                {t, all, edge, 4 * t, sums},
                                {t, all, p.cube_size, 4 * t, sums},
                                {t, all, p.cube_size / 2, 2 * t, sums},
                                {t, all, 0, 2 * t, sums},
                                {t, all, 0, t, sums}};
    for (const EncodeLoad& load : whole)
      if (fits(load)) return load;
    if (!strips) continue;
    for (const std::int64_t flight : {4 * t, t}) {
      const std::int64_t rows = most_rows(all - 1, [&](std::int64_t r) {
        return r < all && fits({t, r, 0, flight, sums});
      });
      if (rows > 0) return EncodeLoad{t, rows, 0, flight, sums};
    }
  }
  return std::nullopt;
}

}  // namespace

std::uint64_t with_heap_overhead(double bytes) {
  return static_cast<std::uint64_t>(std::min(bytes * heap_overhead, 4e18));
}

std::uint64_t memory_of_process(double bytes) {
  return memory_of_program + static_cast<std::uint64_t>(std::min(bytes * heap_overhead, 9e18));
}

double count_of_bricks(const CodingParameters& parameters) {
  const BrickGrid bricks = parameters.bricks();
  return static_cast<double>(bricks.bricks(0)) * static_cast<double>(bricks.bricks(1)) *
         static_cast<double>(bricks.bricks(2));
}

void refuse_memory(const CodingParameters& p, const char* what, const MemoryNeeds& needs) {
  throw MemoryLimit(fmt::format("{} {} x {} x {} {}", what, p.dims.x, p.dims.y, p.dims.z, name_of(p.type)),
                    needs);
}

// The memory of one brick needs less than 64 bits, even for a hostile header.
std::uint64_t memory_of_encoding(const CodingParameters& p, const EncodeLoad& load) {
  constexpr Index3 largest{0, 0, 0};
  const BrickGrid bricks = p.bricks();
  const bool marks = p.counts_points(), strips = load.rows < bricks.bricks(1);
  const std::uint64_t sample = size_of(p.type);
  const Index3 closed = bricks.closed_box(largest).size();
  const std::uint64_t points = static_cast<std::uint64_t>(closed.x * closed.y * closed.z) * sample,
                      bits = static_cast<std::uint64_t>(memory_of_activity(p));
  // A brick that waits for measuring has its grid, and the values of its closed box twice.
  const bool measures = p.mesh_error >= 0;
  const std::uint64_t of_measuring = measures ? points + working_bytes_of_mesh_error(p.type, closed) : 0,
                      waits = measures ? bits + 2 * points : 0;
  const std::uint64_t of_coding = static_cast<std::uint64_t>(samples_to_encode(p, largest).count()) * sample +
                                  bits + working_bytes_of_encoding(p, largest);
  const double of_marks = marks ? std::max(memory_of_marking(p), memory_of_subdividing(p)) : 0;
  const double worker = std::max(of_marks, static_cast<double>(std::max(of_coding, of_measuring)));
  const auto in_flight = static_cast<double>(most_bytes_of_code(p, largest) + bits + waits);
  double kept = GridSchedule::memory(p, load.rows, marks ? std::optional(mark_halo(p)) : std::nullopt,
                                     load.slices_ahead) +
                PageBlocks::memory(count_of_bricks(p));
  if (mesh_needs_bricks_below(p)) kept += static_cast<double>(ClosedSamples::working_bytes(p, load.rows));
  // A stretch of rows has all the samples of its blocks.
  if (load.sums)
    kept += static_cast<double>(
        SlabSums::memory(layout_of_sums(p.dims, p.type, block_edge), p.dims.x,
                         strips ? std::min(p.dims.y, load.rows * bricks.length() + block_edge) : p.dims.y));
  const double bricks_in_flight = std::min(static_cast<double>(load.bricks_in_flight), count_of_bricks(p));
  return memory_of_process(kept + static_cast<double>(load.threads) * worker + bricks_in_flight * in_flight);
}

std::vector<BrickRows> EncodePlan::strips(const BrickGrid& bricks, const BrickRows& part) const {
  if (!in_strips(bricks)) return {part};
  std::vector<BrickRows> result;
  for (std::int64_t z = part.z_low; z < part.z_end; ++z)
    for (std::int64_t y = part.y_low; y < part.y_end; y += rows)
      result.push_back({y, std::min(y + rows, part.y_end), z, z + 1});
  return result;
}

std::uint64_t smallest_memory_of_encoding(const CodingParameters& p, bool strips, std::uint64_t besides,
                                          bool sums) {
  return memory_of_encoding(p, smallest_encoding(p, strips, sums)) + besides;
}

EncodePlan plan_encoding(const CodingParameters& p, const Resources& resources, bool random_access,
                         const EncodeNeeds& needs) {
  const std::int64_t all = p.bricks().bricks(1);
  const bool strips = random_access || resources.spool;
  const EncodeLoad smallest = smallest_encoding(p, strips, needs.sums);
  const EncodeLoad load = within(
      resources,
      [&](std::uint64_t limit) {
        return best_encoding(p, resources.threads, strips, needs.sums, without(needs.besides, limit));
      },
      smallest);
  const std::uint64_t memory = memory_of_encoding(p, load) + needs.besides, limit = allowed_memory(resources);
  // Without an explicit limit, what follows is never refused.
  const bool then_verified = needs.verified && resources.memory;
  const auto with_the_rest_of = [&](const CodingParameters& of, std::uint64_t encoding, bool spooled) {
    if (resources.memory) encoding = std::max(encoding, needs.afterwards);
    if (!then_verified) return encoding;
    return std::max(encoding, needs.verified->smallest(of, needs.verified->original.any_rows || spooled,
                                                       needs.verified->original.memory));
  };
  const auto with_the_rest = [&](std::uint64_t encoding, bool spooled) {
    return with_the_rest_of(p, encoding, spooled);
  };
  if (const std::uint64_t needed = with_the_rest(memory, resources.spool.has_value()); needed > limit) {
    const bool can_spool = !random_access || (then_verified && !needs.verified->original.any_rows);
    std::optional<std::uint64_t> with_spool;
    if (can_spool && !resources.spool && all > 1)
      with_spool = with_the_rest(smallest_memory_of_encoding(p, true, needs.besides, needs.sums), true);
    if (with_spool && *with_spool >= needed) with_spool.reset();
    std::optional<SmallerBrick> brick;
    constexpr int modest = 64;  // samples: of bricks that are not transformed
    if (CodingParameters smaller = p; p.brick_edge > 1 && p.brick_edge * p.cube_size > modest) {
      smaller.brick_edge = std::max(1, modest / p.cube_size);
      const std::uint64_t encoding = smallest_memory_of_encoding(smaller, strips, needs.besides, needs.sums);
      brick = {smaller.brick_edge, with_the_rest_of(smaller, encoding, resources.spool.has_value())};
    }
    refuse_memory(p,
                  then_verified ? "encoding and verifying"
                  : strips      ? "encoding"
                                : "encoding, slice by slice,",
                  {.needed = needed, .allowed = limit, .with_spool = with_spool, .smaller_brick = brick});
  }
  EncodePlan plan;
  plan.budget = {static_cast<int>(load.threads), load.slices_ahead, load.bricks_in_flight};
  plan.rows = load.rows;
  plan.memory = memory;
  plan.spooled = !random_access && load.rows < all;
  return plan;
}

std::int64_t slices_beside(const CodingParameters& p, const EncodePlan& plan, const Resources& resources,
                           std::int64_t most) {
  const std::uint64_t fit =
      without(plan.memory, allowed_memory(resources, 4)) / *sample_bytes({p.dims.x, p.dims.y, 1}, p.type);
  return std::min(most, static_cast<std::int64_t>(std::min(fit, std::uint64_t{1} << 31)));
}

}  // namespace tagrid
