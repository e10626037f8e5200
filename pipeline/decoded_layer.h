// The decoded samples of one layer of bricks, as its bricks come.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "grid/coding_parameters.h"

namespace tagrid {

/// Samples of the bricks of one layer, kept brick by brick: memory grows with what has been decoded, not with
/// the width that a header claims.
class DecodedLayer {
 public:
  explicit DecodedLayer(const CodingParameters& parameters)
      : bricks_(parameters.bricks()),
        edge_(std::int64_t{parameters.brick_edge} * parameters.cube_size),
        size_(size_of(parameters.type)) {}

  /// Adds the samples that the next brick of the layer owns, x fastest.
  void add(std::vector<std::byte> samples) { samples_.push_back(std::move(samples)); }
  bool complete() const { return static_cast<std::int64_t>(samples_.size()) == bricks_.layer_count(); }
  /// Forgets its bricks; the next one is the first of the layer above.
  void begin_next();

  /// The first slice of the layer, and how many there are: those that its bricks own.
  std::int64_t first_slice() const { return owned(0).low.z; }
  std::int64_t slices() const { return owned(0).size().z; }
  /// Bytes of one slice.
  std::size_t slice_bytes() const;

  /// A sample of the layer. REQUIRES: complete(), and first_slice() <= p.z < first_slice() + slices().
  const std::byte* at(Index3 p) const;
  /// Copies slice `z` to `out`, x fastest. REQUIRES: as for at().
  void copy_slice(std::int64_t z, std::span<std::byte> out) const;
  /// Calls use(std::span<const std::byte>) for all slices in z order, some whole ones at a time.
  template <class Use>
  void for_each_part(Use use) const {
    constexpr std::size_t enough = std::size_t{1} << 20;  // for a write to be worth its call
    const std::size_t slice = slice_bytes();
    std::vector<std::byte> part;
    for (std::int64_t z = first_slice(); z < first_slice() + slices(); ++z) {
      part.resize(part.size() + slice);
      copy_slice(z, std::span(part).last(slice));
      if (part.size() < enough && z + 1 < first_slice() + slices()) continue;
      use(std::span<const std::byte>(part));
      part.clear();
    }
  }

 private:
  Box owned(std::int64_t in_layer) const {
    return bricks_.owned_box(bricks_.position(layer_ * bricks_.layer_count() + in_layer));
  }
  std::int64_t brick_of(std::int64_t coordinate) const {
    return coordinate == 0 ? 0 : (coordinate - 1) / edge_;
  }

  BrickGrid bricks_;
  std::int64_t edge_;  ///< of a brick, in samples
  std::size_t size_;   ///< of a sample
  std::int64_t layer_ = 0;
  std::vector<std::vector<std::byte>> samples_;  ///< by brick, in the order of their numbers
};

}  // namespace tagrid
