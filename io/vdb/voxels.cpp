#include "io/vdb/voxels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "io/bytes/checksum.h"
#include "io/vdb/format.h"
#include "io/vdb/values.h"

namespace tagrid {
namespace {

template <class T>
using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;

template <class T>
Bits<T> bits_of(T value) {
  return std::bit_cast<Bits<T>>(value);
}

}  // namespace

template <class T>
VdbVoxels<T>::VdbVoxels(const Box& box, T background, double tolerance, SpoolFile& spool)
    : box_(box), background_(background), tolerance_(tolerance), spool_(spool), leaf_(vdb::leaf_values) {}

template <class T>
bool VdbVoxels<T>::is_background(T value) const {
  if (bits_of(value) == bits_of(background_)) return true;
  return tolerance_ > 0 &&
         std::abs(static_cast<double>(value) - static_cast<double>(background_)) <= tolerance_;
}

template <class T>
void VdbVoxels<T>::add(std::int64_t z, std::int64_t count, const T* voxels) {
  constexpr std::int64_t edge = vdb::leaf_edge;
  const Box slices = {{box_.low.x, box_.low.y, z}, {box_.high.x, box_.high.y, z + count - 1}};
  for (std::int64_t x = box_.low.x & -edge; x <= box_.high.x; x += edge)
    for (std::int64_t y = box_.low.y & -edge; y <= box_.high.y; y += edge) {
      const Index3 low = {x, y, z & -edge};
      gather({low, low + Index3{edge - 1, edge - 1, edge - 1}}, slices, voxels);
      add_leaf(low);
    }
}

/// Copies the voxels that lie in a leaf to leaf_; the rest of leaf_ is background.
template <class T>
void VdbVoxels<T>::gather(const Box& leaf, const Box& voxels_of, const T* voxels) {
  const Box part = intersection(leaf, voxels_of);
  if (part != leaf) std::fill(leaf_.begin(), leaf_.end(), background_);
  for (std::int64_t z = part.low.z; z <= part.high.z; ++z)
    for (std::int64_t y = part.low.y; y <= part.high.y; ++y) {
      const T* row = voxels + voxels_of.offset({part.low.x, y, z});
      T* to =
          leaf_.data() + vdb::entry(part.low.x - leaf.low.x, y - leaf.low.y, z - leaf.low.z, vdb::leaf_log);
      for (std::int64_t x = part.low.x; x <= part.high.x; ++x, ++row, to += vdb::leaf_edge * vdb::leaf_edge)
        *to = is_background(*row) ? background_ : *row;
    }
}

template <class T>
void VdbVoxels<T>::add_leaf(const Index3& low) {
  vdb::Mask<vdb::leaf_values> active;
  T values[vdb::leaf_values];
  std::size_t count = 0;
  for (std::size_t i = 0; i < vdb::leaf_values; ++i) {
    if (bits_of(leaf_[i]) == bits_of(background_)) continue;
    active.set(i);
    values[count++] = leaf_[i];
    const auto n = static_cast<std::int64_t>(i);
    add_active(low + Index3{n / 64, n / 8 % 8, n % 8});
  }
  if (count == 0) return;
  active_count_ += count;
  VdbSlot slot{static_cast<std::int32_t>(low.x), static_cast<std::int32_t>(low.y),
               static_cast<std::int32_t>(low.z)};
  const auto is_first = [&](T value) { return bits_of(value) == bits_of(values[0]); };
  if (count == vdb::leaf_values && std::all_of(values, values + count, is_first)) {
    slot.where = bits_of(values[0]);
    checksum_ = chained_checksum(checksum_of({std::as_bytes(std::span(values, 1))}), checksum_);
  } else {
    const auto mask = active.bytes();
    record_.assign(mask.begin(), mask.end());
    record_.push_back(static_cast<std::byte>(vdb::Inactive::background));
    append_vdb_values(record_, values, count);
    slot.where = spool_.size();
    slot.size = static_cast<std::uint32_t>(record_.size());
    spool_.write(record_);
    checksum_ = chained_checksum(checksum_of({record_}), checksum_);
  }
  slots_.push_back(slot);
}

template <class T>
void VdbVoxels<T>::add_active(const Index3& voxel) {
  if (!active_) active_ = Box{voxel, voxel};
  for (int axis = 0; axis < 3; ++axis) {
    active_->low[axis] = std::min(active_->low[axis], voxel[axis]);
    active_->high[axis] = std::max(active_->high[axis], voxel[axis]);
  }
}

template <class T>
T vdb_tile_value(const VdbSlot& tile) {
  return std::bit_cast<T>(static_cast<Bits<T>>(tile.where));
}

#define TAGRID_VDB_VOXELS(T)   \
  template class VdbVoxels<T>; \
  template T vdb_tile_value<T>(const VdbSlot&);
TAGRID_VDB_VOXELS(float)
TAGRID_VDB_VOXELS(double)
TAGRID_VDB_VOXELS(std::int32_t)

}  // namespace tagrid
