// Decoded rows of bricks, cut from a volume in memory.
#pragma once

#include <functional>
#include <vector>

#include "pipeline/decode/decoded_rows.h"

namespace tagrid {

/// Calls use(rows) for `all`, `together` rows of bricks at a time, as a decoder of `samples` does.
template <class T>
void for_each_rows(const CodingParameters& parameters, const BrickRows& all, std::int64_t together,
                   const std::vector<T>& samples, const std::function<void(const DecodedRows&)>& use) {
  const BrickGrid bricks = parameters.bricks();
  const Box volume = bricks.domain.volume();
  DecodedRows rows(parameters, all, together);
  const std::int64_t first = all.first_brick(bricks);
  for (std::int64_t id = first; id < first + all.count(bricks); ++id) {
    const Box box = bricks.owned_box(bricks.position(id));
    std::vector<std::byte> owned;
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
        const auto* row = reinterpret_cast<const std::byte*>(
            &samples[static_cast<std::size_t>(volume.offset({box.low.x, y, z}))]);
        owned.insert(owned.end(), row, row + static_cast<std::size_t>(box.size().x) * sizeof(T));
      }
    rows.add(std::move(owned));
    if (!rows.complete()) continue;
    use(rows);
    if (id + 1 < first + all.count(bricks)) rows.begin_next();
  }
}

}  // namespace tagrid
