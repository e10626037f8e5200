// Magnitudes and signs of the coefficients that are known of a brick, and what they say of those that are not: of a
// block, the sums of its parents and siblings; of a coefficient, an expected magnitude.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/values/transform/shape.h"
#include "stages/values/transform/start_tables.h"

namespace tagrid {

/// The edge of a block of coefficients, which has a flag and a sum; and the length of a group along x.
inline constexpr std::int64_t coefficient_block = 4;

/// Where the coefficients of a band are among those of all bands. Bands have zeros around.
struct BandPlace {
  static constexpr std::int64_t before = 2, after = 2, after_x = 9;

  explicit BandPlace(const Index3& size)
      : row(size.x + before + after_x),
        slice(row * (size.y + before + after)),
        slices(size.z + before + after) {
    for (int axis = 0; axis < 3; ++axis)
      blocks[axis] = (size[axis] + coefficient_block - 1) / coefficient_block;
  }
  std::size_t padded_count() const { return static_cast<std::size_t>(slice * slices); }
  std::size_t block_count() const { return static_cast<std::size_t>(blocks.x * blocks.y * blocks.z); }

  std::size_t offset = 0;  ///< of the first coefficient
  std::int64_t row, slice, slices;
  std::size_t blocks_offset = 0;  ///< of the first block
  Index3 blocks{};
  bool is_zero = true;
};

/// What the magnitudes of a band are expected from.
struct Surroundings {
  const std::int16_t* weights;
  std::array<std::int64_t, own_features> own;  ///< offsets of neighbours, in the order of their weights
  const BandPlace* parent = nullptr;
  std::array<const BandPlace*, 3> siblings{};
};

/// What the coefficients around a group say about each of its own.
struct GroupContext {
  using Sums = std::array<std::int32_t, coefficient_block>;
  alignas(16) Sums expected;  ///< weighted sum of all
  Sums around, parent;        ///< sums of neighbours; of the parent and its neighbours
};

class Magnitudes {
 public:
  explicit Magnitudes(const TransformShape& shape) : shape_(shape) {
    std::size_t bytes = 0, blocks = 0;
    for (const Band& band : shape.bands) {
      BandPlace place(band.size);
      place.offset = bytes + static_cast<std::size_t>(BandPlace::before * (place.slice + place.row + 1));
      place.blocks_offset = blocks;
      bytes += place.padded_count();
      blocks += place.block_count();
      places_.push_back(place);
    }
    magnitudes_.resize(bytes);
    signs_.resize(bytes, 1);
    sums_.resize(blocks);
    active_.resize(blocks);
  }

  /// The heap that this takes.
  static std::uint64_t working_bytes(const TransformShape& shape) {
    std::uint64_t bytes = shape.bands.size() * sizeof(BandPlace);
    for (const Band& band : shape.bands) {
      const BandPlace place(band.size);
      bytes +=
          2 * place.padded_count() + place.block_count() * (sizeof(std::uint32_t) + sizeof(std::uint8_t));
    }
    return bytes;
  }

  BandPlace& place(std::size_t band) { return places_[band]; }
  bool is_zero(int band) const { return band == no_band || place_of(band).is_zero; }

  /// The magnitude of a coefficient, at most 255.
  std::uint8_t* at(const BandPlace& place, Index3 at) { return magnitudes_.data() + offset_of(place, at); }
  /// Of the coefficient whose magnitude is given: 0: negative, 1: the coefficient is 0, 2: positive.
  std::uint8_t* sign_of(const std::uint8_t* magnitude) {
    return signs_.data() + (magnitude - magnitudes_.data());
  }
  /// Flags of the blocks of a band: whether one has a magnitude.
  std::span<std::uint8_t> active_blocks(const BandPlace& place) {
    return std::span(active_).subspan(place.blocks_offset, place.block_count());
  }
  /// The sum of the magnitudes of a block of a band.
  std::uint32_t& sum_of_block(const BandPlace& place, std::size_t block) {
    return sums_[place.blocks_offset + block];
  }

  /// The sum of the magnitudes of all parents of a block.
  std::uint32_t parent_of_block(const Band& band, Index3 block) const {
    if (is_zero(band.parent)) return 0;
    const BandPlace& parent = place_of(band.parent);
    const Index3 size = shape_.bands[static_cast<std::size_t>(band.parent)].size;
    Index3 low, end;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = block[axis] * coefficient_block >> band.parent_shift[axis];
      end[axis] = std::min(low[axis] + (coefficient_block >> band.parent_shift[axis]), size[axis]);
    }
    std::uint32_t sum = 0;
    for (std::int64_t z = low.z; z < end.z; ++z)
      for (std::int64_t y = low.y; y < end.y; ++y)
        for (std::int64_t x = low.x; x < end.x; ++x) sum += *at(parent, {x, y, z});
    return sum;
  }

  /// The sum of the magnitudes of the same block of the siblings.
  std::uint32_t siblings_of_block(const Band& band, Index3 block) const {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < 3 && band.siblings[i] != no_band; ++i) {
      const BandPlace& sibling = place_of(band.siblings[i]);
      const std::int64_t z = block.z >> band.sibling_shift[i];
      if (sibling.is_zero || block.x >= sibling.blocks.x || block.y >= sibling.blocks.y ||
          z >= sibling.blocks.z)
        continue;
      sum += sums_[sibling.blocks_offset +
                   static_cast<std::size_t>((z * sibling.blocks.y + block.y) * sibling.blocks.x + block.x)];
    }
    return sum;
  }

  Surroundings surroundings_of(const Band& band, const BandPlace& place) const {
    const std::int64_t r = place.row, s = place.slice;
    Surroundings a;
    a.weights = feature_weights[static_cast<std::size_t>(band.orientation + 8 * (band.level > 1))].data();
    a.own = {-1,    -r, -s,     -1 - r, 1 - r,      -1 - s,    1 - s,      -r - s,
             r - s, -2, -2 * r, -2 * s, -1 - r - s, 1 - r - s, -1 + r - s, 1 + r - s};
    if (!is_zero(band.parent)) a.parent = &place_of(band.parent);
    for (std::size_t i = 0; i < 3 && band.siblings[i] != no_band; ++i)
      if (!is_zero(band.siblings[i])) a.siblings[i] = &place_of(band.siblings[i]);
    return a;
  }

  /// Of the group whose first coefficient is at `group` of the band.
  GroupContext look_around(const Band& band, const BandPlace& place, const Surroundings& around,
                           Index3 group) const {
    const std::uint8_t* const here = at(place, group);
    const std::int16_t* const w = around.weights;
    GroupContext::Sums expected{}, near{}, parent{};
    const auto add = [&](std::size_t i, std::int32_t of_sum) {
      const std::uint8_t* const m = here + around.own[i];
      for (std::size_t k = 0; k < coefficient_block; ++k) {
        expected[k] += w[i] * m[k];
        near[k] += of_sum * m[k];
      }
    };
    for (const std::size_t i : {1, 2}) add(i, 2);
    for (const std::size_t i : {4, 6, 7, 8, 10, 11, 12, 13, 14, 15, 3, 5}) add(i, 1);
    if (around.parent != nullptr) {
      const BandPlace& p = *around.parent;
      const Index3& shift = band.parent_shift;
      const std::uint8_t* const first = at(p, {group.x >> shift.x, group.y >> shift.y, group.z >> shift.z});
      for (std::size_t k = 0; k < coefficient_block; ++k) {
        const std::uint8_t* const m = first + (k >> shift.x);
        const std::int32_t along_x = m[-1] + m[1], along_y = m[-p.row] + m[p.row],
                           along_z = m[-p.slice] + m[p.slice];
        expected[k] += w[16] * m[0] + w[17] * along_x + w[18] * along_y + w[19] * along_z;
        parent[k] = 2 * m[0] + along_x + along_y + along_z;
      }
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (around.siblings[i] == nullptr) continue;
      const BandPlace& s = *around.siblings[i];
      const std::uint8_t* m = at(s, {group.x, group.y, group.z >> band.sibling_shift[i]});
      for (std::size_t k = 0; k < coefficient_block; ++k, ++m)
        expected[k] +=
            w[20 + i] * m[0] + w[23 + i] * (m[-1] + m[1] + m[-s.row] + m[s.row] + m[-s.slice] + m[s.slice]);
    }
    return {expected, near, parent};
  }

 private:
  const BandPlace& place_of(int band) const { return places_[static_cast<std::size_t>(band)]; }
  static std::int64_t offset_of(const BandPlace& place, const Index3& at) {
    return static_cast<std::int64_t>(place.offset) + at.z * place.slice + at.y * place.row + at.x;
  }
  const std::uint8_t* at(const BandPlace& place, Index3 at) const {
    return magnitudes_.data() + offset_of(place, at);
  }

  const TransformShape& shape_;
  std::vector<BandPlace> places_;
  std::vector<std::uint8_t> magnitudes_, signs_;
  std::vector<std::uint32_t> sums_;   ///< of the magnitudes of blocks
  std::vector<std::uint8_t> active_;  ///< flags of blocks
};

}  // namespace tagrid
