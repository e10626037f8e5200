// The slices of a .tag file that a layer of a mesh needs, decoded in the order of z.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "io/tag/bricks.h"
#include "pipeline/decode/values.h"
#include "stages/grid/box.h"
#include "stages/materials/material_field.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Values of the samples of a volume, between two planes that move up. Each layer of bricks of the file is decoded once.
class SampleWindow {
 public:
  /// Only samples in `needed`, counted from 0 in the volume, will be asked for. `file` must stay.
  SampleWindow(const TagBricks& file, const WrittenNumbers& numbers, const Box& needed, int threads);

  /// Forgets slices below `low` and decodes those up to `high`. Throws BrokenInput, WorldError.
  /// REQUIRES: neither ever falls.
  void move_to(std::int64_t low, std::int64_t high);

  /// The labels in a box. REQUIRES: the window has the box; all samples are labels.
  std::vector<Material> labels(const Box& box) const;
  /// The values in a box minus `reference`, near which float32 is exact. Infinities become very large numbers, and NaN
  /// the lowest one, so that there is always a value between two. REQUIRES: the window has the box.
  std::vector<float> values(const Box& box, double reference) const;
  static constexpr double largest_value = 1e37;

  /// The heap that a window of so many slices takes.
  static std::uint64_t working_bytes(const CodingParameters& parameters, const WrittenNumbers& numbers,
                                     const Box& needed, std::int64_t slices);

 private:
  struct Layer {
    Box box;
    std::vector<std::byte> bytes;
  };

  // `number(sample)` for all samples in a box.
  template <class Number, class NumberOf>
  std::vector<Number> numbers(const Box& box, NumberOf number) const;

  const TagBricks& file_;
  WrittenNumbers numbers_;
  SampleType type_;
  Box needed_;
  int threads_;
  std::int64_t next_;  ///< the first slice that was not decoded yet
  std::deque<Layer> layers_;
};

}  // namespace tagrid
