#include "pipeline/decoded_layer.h"

#include <cassert>
#include <cstring>

namespace tagrid {

void DecodedLayer::begin_next() {
  samples_.clear();
  samples_.shrink_to_fit();
  ++layer_;
}

std::size_t DecodedLayer::slice_bytes() const {
  const Index3& dims = bricks_.domain.dims;
  return static_cast<std::size_t>(dims.x * dims.y) * size_;
}

const std::byte* DecodedLayer::at(Index3 p) const {
  assert(complete());
  const std::int64_t brick = brick_of(p.y) * bricks_.bricks(0) + brick_of(p.x);
  return samples_[static_cast<std::size_t>(brick)].data() +
         static_cast<std::size_t>(owned(brick).offset(p)) * size_;
}

void DecodedLayer::copy_slice(std::int64_t z, std::span<std::byte> out) const {
  assert(complete() && out.size() == slice_bytes());
  for (std::size_t brick = 0; brick < samples_.size(); ++brick) {
    const Box box = owned(static_cast<std::int64_t>(brick));
    const std::size_t row = static_cast<std::size_t>(box.size().x) * size_;
    const std::byte* from =
        samples_[brick].data() + static_cast<std::size_t>(box.offset({box.low.x, box.low.y, z})) * size_;
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y, from += row)
      std::memcpy(out.data() + static_cast<std::size_t>(y * bricks_.domain.dims.x + box.low.x) * size_, from,
                  row);
  }
}

}  // namespace tagrid
