// The slices of a .tag file that a layer of a mesh needs, decoded in the order of z.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "io/tag/bricks.h"
#include "pipeline/decode/values.h"
#include "pipeline/progress/progress.h"
#include "stages/grid/box.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Values of the samples of a volume, between two planes that move up. Each layer of bricks of the file is decoded once.
class SampleWindow {
 public:
  /// Only samples in `needed`, counted from 0 in the volume, will be asked for. `file` must stay.
  SampleWindow(const TagBricks& file, const WrittenNumbers& numbers, const Box& needed, int threads,
               Progress progress);

  /// Forgets slices below `low` and decodes those up to `high`. Throws BrokenInput, WorldError.
  /// REQUIRES: neither ever falls.
  void move_to(std::int64_t low, std::int64_t high);

  /// The values in a box, as numbers of another type: To(value). REQUIRES: the window has the box.
  template <class To>
  std::vector<To> values(const Box& box) const;

  /// The heap that a window of so many slices takes.
  static std::uint64_t working_bytes(const CodingParameters& parameters, const WrittenNumbers& numbers,
                                     const Box& needed, std::int64_t slices);

 private:
  struct Layer {
    Box box;
    std::vector<std::byte> bytes;
  };

  const TagBricks& file_;
  WrittenNumbers numbers_;
  SampleType type_;
  Box needed_;
  int threads_;
  Progress progress_;
  std::int64_t next_;  ///< the first slice that was not decoded yet
  std::deque<Layer> layers_;
};

template <class To>
std::vector<To> SampleWindow::values(const Box& box) const {
  std::vector<To> result(static_cast<std::size_t>(box.count()));
  with_sample_type(type_, [&](auto type) {
    using T = decltype(type);
    for (const Layer& layer : layers_) {
      const Box part = intersection(box, layer.box);
      if (part.empty()) continue;
      const Samples<T> samples{layer.box, reinterpret_cast<const T*>(layer.bytes.data())};
      const auto row = static_cast<std::size_t>(part.size().x);
      for (std::int64_t z = part.low.z; z <= part.high.z; ++z)
        for (std::int64_t y = part.low.y; y <= part.high.y; ++y) {
          const T* const from = &samples.at({part.low.x, y, z});
          To* const to = result.data() + box.offset({part.low.x, y, z});
          for (std::size_t i = 0; i < row; ++i) to[i] = static_cast<To>(from[i]);
        }
    }
  });
  return result;
}

}  // namespace tagrid
