// Decodes one block of a file, and finds the range of its samples, which the index knows, too.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/tag/blocks.h"
#include "io/tag/index.h"
#include "stages/brick/decode.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// The brick of a block. Throws BrokenInput if it cannot be decoded; the message begins with `name`, that of
/// the file, unless it is "". `slices`: see BrickRequest.
DecodedBrick decode_block(const BrickBytes& block, const CodingParameters& parameters,
                          const std::string& name, Wanted wanted, std::int64_t slices = all_slices);

struct ValueRange {
  double low = INFINITY, high = -INFINITY;
  std::uint64_t finite = 0;  ///< how many samples are finite
};

inline ValueRange value_range(const std::vector<std::byte>& samples, SampleType type) {
  ValueRange range;
  with_sample_type(type, [&](auto sample) {
    using T = decltype(sample);
    const auto* first = reinterpret_cast<const T*>(samples.data());
    for (std::size_t i = 0; i < samples.size() / sizeof(T); ++i) {
      if (!is_finite(first[i])) continue;
      ++range.finite;
      range.low = std::min(range.low, static_cast<double>(first[i]));
      range.high = std::max(range.high, static_cast<double>(first[i]));
    }
  });
  return range;
}

/// True if these can be the decoded samples of a brick of which the index says this. `max_error` is the largest error that
/// the index records.
inline bool can_be_of(const ValueRange& range, const IndexEntry& brick, double max_error) {
  // Without finite samples both are infinite, and their difference is a NaN.
  return !(std::abs(range.low - brick.low) > max_error || std::abs(range.high - brick.high) > max_error);
}

}  // namespace tagrid
