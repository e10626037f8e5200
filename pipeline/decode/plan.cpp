#include "pipeline/decode/graph.h"

#include <algorithm>
#include <optional>

#include "io/tag/pages.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/grid/schedule.h"
#include "pipeline/memory/plan.h"
#include "stages/brick/codec.h"

namespace tagrid {
namespace {

// What the largest brick takes. For a hostile header, sums over all bricks need more than 64 bits. The
// memory of one brick does not.
struct LargestBrick {
  explicit LargestBrick(const CodingParameters& p)
      : code(static_cast<double>(most_bytes_of_code(p, {0, 0, 0}))),
        owned(static_cast<double>(p.bricks().owned_box({0, 0, 0}).count())),
        sample(static_cast<double>(size_of(p.type))),
        bits(memory_of_activity(p)) {
    if (p.mode == FileMode::grid)
      points = static_cast<double>(p.bricks().closed_box({0, 0, 0}).count()) * sample;
  }
  double code, owned, sample, bits, points = 0;
};

double work_of_decoding(const CodingParameters& p, bool with_grid) {
  return static_cast<double>(
      working_bytes_of_decoding(p, {0, 0, 0}, with_grid ? Wanted::samples_and_grid : Wanted::samples));
}

// The index of a file that is decoded front to back, or by the index.
double index_of_decoding(const CodingParameters& p) {
  const double bricks = count_of_bricks(p);
  return std::max(PageBlocks::memory(bricks), TagPages::memory(bricks));
}

std::optional<DecodeLoad> best_decoding(const CodingParameters& p, DecodeLoad load, bool strips,
                                        std::uint64_t limit) {
  const std::int64_t all = p.bricks().bricks(1), threads = load.threads;
  for (std::int64_t t = threads; t >= 1; --t)
    for (const std::int64_t flight : {16 * t, 4 * t, t}) {
      // With one thread, reading ahead of time only takes memory.
      if (t == 1 && flight > 1) continue;
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

}  // namespace

std::uint64_t memory_of_decoding(const CodingParameters& p, const DecodeLoad& load) {
  const LargestBrick brick(p);
  const auto threads = static_cast<double>(load.threads);
  const double values = brick.owned * static_cast<double>(load.value_bytes);
  // A brick waits as its encoded bytes, and then decoded.
  double decoded = values > 0 ? values : brick.owned * brick.sample;
  if (load.with_grid && p.stores_activity()) decoded += brick.bits + brick.points;
  const double in_flight = std::min(static_cast<double>(load.bricks_in_flight), count_of_bricks(p));
  // The reader has a brick as read and as parsed, the one before it, and one more that the heap still holds.
  const double flight = in_flight * std::max(brick.code, decoded) + 4 * brick.code;
  // While samples become values, both are there.
  const double work = threads * (work_of_decoding(p, load.with_grid) + values);
  const bool derives = load.with_grid && !p.stores_activity();
  const double grid = derives ? DerivedGrid::memory(p, load.threads) : 0;
  return memory_of_process(DecodedRows::memory(p, load.rows, load.threads, load.value_bytes) + flight + work +
                           grid + (load.kept ? load.kept(p, load) : 0) + index_of_decoding(p));
}

std::uint64_t memory_of_reading(const CodingParameters& p, std::int64_t threads, bool with_grid) {
  // The block of the brick, as read and as parsed, and the freed memory of the brick before it.
  const LargestBrick brick(p);
  const double each = 2 * brick.code + brick.owned * brick.sample + work_of_decoding(p, with_grid);
  return memory_of_process(static_cast<double>(threads) * each + index_of_decoding(p));
}

DecodePlan plan_decoding(const CodingParameters& p, const Resources& resources, DecodeUse use,
                         std::uint64_t besides, std::size_t value_bytes, decltype(DecodeLoad::kept) kept) {
  besides += resources.besides;
  const std::int64_t all = p.bricks().bricks(1);
  const bool any_order = use == DecodeUse::write || use == DecodeUse::verify;
  const bool in_order = use == DecodeUse::stream || use == DecodeUse::verify_stream;
  const bool may_spool = in_order && resources.spool;
  const bool verifies = use == DecodeUse::verify || use == DecodeUse::verify_stream;
  DecodeLoad smallest;
  smallest.with_grid = verifies || use == DecodeUse::mesh;
  smallest.value_bytes = value_bytes;
  smallest.kept = kept;
  DecodeLoad wanted = smallest;
  wanted.threads = resources.threads;
  const auto planned = [&](const DecodeLoad& load, bool spooled, bool derives) -> DecodePlan {
    return {{static_cast<int>(load.threads), load.bricks_in_flight, load.rows},
            memory_of_decoding(p, load) + besides,
            spooled,
            derives};
  };
  if (verifies && !p.stores_activity()) {
    // A grid is derived from whole layers. If they do not fit, it is not.
    wanted.rows = all;
    if (const auto load = best_decoding(p, wanted, false, without(besides, allowed_memory(resources))))
      return planned(*load, false, true);
    smallest.with_grid = wanted.with_grid = false;
  }
  const bool strips = any_order || may_spool;
  smallest.rows = wanted.rows = strips ? 1 : all;
  const DecodeLoad load = within(
      resources,
      [&](std::uint64_t limit) { return best_decoding(p, wanted, strips, without(besides, limit)); },
      smallest);
  const DecodePlan plan = planned(load, strips && may_spool && load.rows < all, false);
  // Without an explicit limit, a file is decoded as far as possible: its header may be wrong.
  if (resources.memory && plan.memory > *resources.memory) {
    std::optional<std::uint64_t> with_spool;
    if (in_order && !may_spool && all > 1) {
      smallest.rows = 1;
      with_spool = memory_of_decoding(p, smallest) + besides;
    }
    refuse_memory(p,
                  use == DecodeUse::mesh ? "decoding the grid of"
                  : verifies             ? "verifying"
                                         : "decoding",
                  {.needed = plan.memory, .allowed = *resources.memory, .with_spool = with_spool});
  }
  return plan;
}

}  // namespace tagrid
