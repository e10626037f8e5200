#include "pipeline/memory/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "io/errors/errors.h"
#include "io/volume/volume_info.h"

namespace tagrid {
namespace {

// The smallest possible load. Strips need more slices than whole layers, so they may need more memory.
EncodeLoad smallest_encoding(const CodingParameters& p, bool strips, bool sums) {
  // {threads, rows, slices ahead, bricks in flight, sums}
  const EncodeLoad strip = {1, 1, 0, 1, sums}, whole = {1, p.bricks().bricks(1), 0, 1, sums};
  return strips && memory_of_encoding(p, strip) < memory_of_encoding(p, whole) ? strip : whole;
}

std::uint64_t less(std::uint64_t limit, std::uint64_t besides) { return limit - std::min(limit, besides); }

// The largest number of rows that fit, or 0. More rows never need less memory.
std::int64_t most_rows(std::int64_t all, const std::function<bool(std::int64_t)>& fit) {
  if (!fit(1)) return 0;
  std::int64_t low = 1, high = all;
  while (low < high) {
    const std::int64_t middle = high - (high - low) / 2;
    if (fit(middle))
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

// Strips come before fewer threads: they read and mark some rows twice, but fewer threads slow everything.
std::optional<EncodeLoad> best_encoding(const CodingParameters& p, std::int64_t threads, bool strips,
                                        bool sums, std::uint64_t limit) {
  const std::int64_t all = p.bricks().bricks(1), edge = p.bricks().length();
  const auto fits = [&](const EncodeLoad& load) { return memory_of_encoding(p, load) <= limit; };
  for (std::int64_t t = threads; t >= 1; --t) {
    // {threads, rows, slices ahead, bricks in flight, sums}. With one thread, preparing work ahead of time only
    // takes memory.
    const EncodeLoad most = t == 1 ? EncodeLoad{1, all, 4, 4, sums} : EncodeLoad{t, all, edge, 16 * t, sums};
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

std::optional<DecodeLoad> best_decoding(const CodingParameters& p, DecodeLoad load, bool strips,
                                        std::uint64_t limit) {
  const std::int64_t all = p.bricks().bricks(1), threads = load.threads;
  for (std::int64_t t = threads; t >= 1; --t)
    for (const std::int64_t flight : {16 * t, 4 * t, t}) {
      load.threads = t;
      load.bricks_in_flight = flight;
      const auto fits = [&](std::int64_t rows) {
        load.rows = rows;
        return memory_of_decoding(p, load) <= limit;
      };
      if (fits(all)) return load;
      if (!strips || all == 1 || (flight > t && !fits(1))) continue;
      if (const std::int64_t rows = most_rows(all - 1, fits); rows > 0) {
        load.rows = rows;
        return load;
      }
    }
  return std::nullopt;
}

DecodeLoad smallest_verifying(const CodingParameters& p, bool strips) {
  DecodeLoad load;
  load.inspect = true;
  load.with_grid = p.stores_activity();
  load.rows = strips ? 1 : p.bricks().bricks(1);
  return load;
}

[[noreturn]] void refuse(const CodingParameters& p, const char* what, std::uint64_t limit,
                         std::uint64_t needed, std::optional<std::uint64_t> with_spool,
                         std::optional<SmallerBrick> brick = {}) {
  throw MemoryLimit(fmt::format("{} {} x {} x {} {}", what, p.dims.x, p.dims.y, p.dims.z, name_of(p.type)),
                    limit, needed, with_spool, brick);
}

}  // namespace

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

std::uint64_t smallest_memory_of_verifying(const CodingParameters& p, bool strips, std::uint64_t besides) {
  return memory_of_decoding(p, smallest_verifying(p, strips)) + besides;
}

EncodePlan plan_encoding(const CodingParameters& p, const Resources& resources, bool random_access,
                         const EncodeNeeds& needs) {
  const std::int64_t all = p.bricks().bricks(1);
  const bool strips = random_access || !resources.spool.empty();
  const EncodeLoad smallest = smallest_encoding(p, strips, needs.sums);
  const EncodeLoad load = within(
      resources,
      [&](std::uint64_t limit) {
        return best_encoding(p, resources.threads, strips, needs.sums, less(limit, needs.besides));
      },
      smallest);
  const std::uint64_t memory = memory_of_encoding(p, load) + needs.besides, limit = allowed_memory(resources);
  // Without an explicit limit, what follows is never refused.
  const bool then_verified = needs.verified && resources.memory;
  const auto with_the_rest_of = [&](const CodingParameters& of, std::uint64_t encoding, bool spooled) {
    if (resources.memory) encoding = std::max(encoding, needs.afterwards);
    if (!then_verified) return encoding;
    return std::max(encoding, smallest_memory_of_verifying(of, needs.verified->any_rows || spooled,
                                                           needs.verified->memory));
  };
  const auto with_the_rest = [&](std::uint64_t encoding, bool spooled) {
    return with_the_rest_of(p, encoding, spooled);
  };
  if (const std::uint64_t needed = with_the_rest(memory, !resources.spool.empty()); needed > limit) {
    const bool can_spool = !random_access || (then_verified && !needs.verified->any_rows);
    std::optional<std::uint64_t> with_spool;
    if (can_spool && resources.spool.empty() && all > 1)
      with_spool = with_the_rest(smallest_memory_of_encoding(p, true, needs.besides, needs.sums), true);
    if (with_spool && *with_spool >= needed) with_spool.reset();
    std::optional<SmallerBrick> brick;
    constexpr int modest = 64;  // samples: of bricks that are not transformed
    if (CodingParameters smaller = p; p.brick_edge > 1 && p.brick_edge * p.cube_size > modest) {
      smaller.brick_edge = std::max(1, modest / p.cube_size);
      const std::uint64_t encoding = smallest_memory_of_encoding(smaller, strips, needs.besides, needs.sums);
      brick = {smaller.brick_edge, with_the_rest_of(smaller, encoding, !resources.spool.empty())};
    }
    refuse(p,
           then_verified ? "encoding and verifying"
           : strips      ? "encoding"
                         : "encoding, slice by slice,",
           limit, needed, with_spool, brick);
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
      less(allowed_memory(resources, 4), plan.memory) / *sample_bytes({p.dims.x, p.dims.y, 1}, p.type);
  return std::min(most, static_cast<std::int64_t>(std::min(fit, std::uint64_t{1} << 31)));
}

DecodePlan plan_decoding(const CodingParameters& p, const Resources& resources, DecodeUse use,
                         std::uint64_t besides, std::size_t value_bytes) {
  besides += resources.besides;
  const std::int64_t all = p.bricks().bricks(1);
  const bool any_order = use == DecodeUse::write || use == DecodeUse::verify;
  const bool in_order = use == DecodeUse::stream || use == DecodeUse::verify_stream;
  const bool may_spool = in_order && !resources.spool.empty();
  DecodeLoad smallest;
  smallest.inspect = use == DecodeUse::verify || use == DecodeUse::verify_stream;
  smallest.with_grid = smallest.inspect || use == DecodeUse::mesh;
  smallest.value_bytes = value_bytes;
  DecodeLoad wanted = smallest;
  wanted.threads = resources.threads;
  const auto planned = [&](const DecodeLoad& load, bool spooled, bool derives) -> DecodePlan {
    return {{static_cast<int>(load.threads), load.bricks_in_flight, load.rows},
            memory_of_decoding(p, load) + besides,
            spooled,
            derives};
  };
  if (smallest.inspect && !p.stores_activity()) {
    // A grid is derived from whole layers. If they do not fit, it is not.
    wanted.rows = all;
    if (const auto load = best_decoding(p, wanted, false, less(allowed_memory(resources), besides)))
      return planned(*load, false, true);
    smallest.with_grid = wanted.with_grid = false;
  }
  const bool strips = any_order || may_spool;
  smallest.rows = wanted.rows = strips ? 1 : all;
  const DecodeLoad load = within(
      resources, [&](std::uint64_t limit) { return best_decoding(p, wanted, strips, less(limit, besides)); },
      smallest);
  const DecodePlan plan = planned(load, strips && may_spool && load.rows < all, false);
  // Without an explicit limit, a file is decoded as far as possible: its header may be wrong.
  if (resources.memory && plan.memory > *resources.memory) {
    std::optional<std::uint64_t> with_spool;
    if (in_order && !may_spool && all > 1) {
      smallest.rows = 1;
      with_spool = memory_of_decoding(p, smallest) + besides;
    }
    refuse(p,
           use == DecodeUse::mesh ? "decoding the grid of"
           : smallest.inspect     ? "verifying"
                                  : "decoding",
           *resources.memory, plan.memory, with_spool);
  }
  return plan;
}

}  // namespace tagrid
