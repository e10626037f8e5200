#include "stages/brick/closed_samples.h"

#include <algorithm>
#include <cstring>

namespace tagrid {
namespace {

template <class Visit>
void for_each_row(const Box& box, Visit visit) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y) visit(y, z);
}

}  // namespace

std::vector<BrickRows> rows_below(const BrickRows& rows) {
  std::vector<BrickRows> below;
  const std::int64_t y = rows.y_low, z = rows.z_low;
  if (y > 0 && z > 0) below.push_back({y - 1, y, z - 1, z});
  if (z > 0) below.push_back({y, rows.y_end, z - 1, z});
  if (y > 0) below.push_back({y - 1, y, z, z + 1});
  return below;
}

ClosedSamples::ClosedSamples(const CodingParameters& parameters, const BrickRows& rows)
    : bricks_(parameters.bricks()),
      size_(size_of(parameters.type)),
      volume_(bricks_.domain.volume()),
      y_first_(std::max(bricks_.closed_box({0, std::max<std::int64_t>(rows.y_low - 1, 0), 0}).low.y,
                        volume_.low.y)),
      row_(parameters.dims.x) {
  const std::int64_t rows_of_samples =
      std::min(bricks_.closed_box({0, rows.y_end - 1, 0}).high.y, volume_.high.y) - y_first_ + 1;
  // No brick has more samples in its closed box.
  const Index3 closed = bricks_.closed_box({0, 0, 0}).size(), all = volume_.size();
  const std::int64_t y = std::min(closed.y, all.y), z = std::min(closed.z, all.z);
  const std::int64_t samples[3] = {y * z, row_ * z, row_ * rows_of_samples};
  for (int axis = 0; axis < 3; ++axis)
    if (bricks_.bricks(axis) > 1) faces_[axis].resize(static_cast<std::size_t>(samples[axis]) * size_);
}

std::uint64_t ClosedSamples::working_bytes(const CodingParameters& parameters, std::int64_t rows) {
  const std::int64_t nx = parameters.dims.x, edge = parameters.bricks().length(), face = edge + 1,
                     all = std::min(parameters.dims.y, (rows + 1) * edge + 1);
  return static_cast<std::uint64_t>(nx * all + nx * face + face * face) * size_of(parameters.type);
}

std::size_t ClosedSamples::face_offset(int axis, const Box& box, Index3 p) const {
  const std::int64_t at = axis == 0   ? (p.z - box.low.z) * box.size().y + p.y - box.low.y
                          : axis == 1 ? (p.z - box.low.z) * row_ + p.x - volume_.low.x
                                      : (p.y - y_first_) * row_ + p.x - volume_.low.x;
  return static_cast<std::size_t>(at) * size_;
}

std::vector<std::byte> ClosedSamples::complete(Index3 position, const std::vector<std::byte>& owned) {
  const Box closed = bricks_.closed_box(position), box = intersection(closed, volume_),
            own = bricks_.owned_box(position);
  std::vector<std::byte> samples(static_cast<std::size_t>(closed.count()) * size_);
  const auto at = [&](Index3 p) {
    return samples.data() + static_cast<std::size_t>(closed.offset(p)) * size_;
  };
  const auto bytes = [&](std::int64_t count) { return static_cast<std::size_t>(count) * size_; };

  for (int axis = 2; axis >= 0; --axis) {
    if (position[axis] == 0) continue;
    Box face = box;
    face.high[axis] = box.low[axis];
    for_each_row(face, [&](std::int64_t y, std::int64_t z) {
      const Index3 p{face.low.x, y, z};
      std::memcpy(at(p), faces_[axis].data() + face_offset(axis, box, p), bytes(face.size().x));
    });
  }
  for_each_row(own, [&](std::int64_t y, std::int64_t z) {
    const Index3 p{own.low.x, y, z};
    std::memcpy(at(p), owned.data() + bytes(own.offset(p)), bytes(own.size().x));
  });
  for (int axis = 0; axis < 3; ++axis) {
    if (position[axis] + 1 == bricks_.bricks(axis)) continue;
    Box face = box;
    face.low[axis] = box.high[axis];
    for_each_row(face, [&](std::int64_t y, std::int64_t z) {
      const Index3 p{face.low.x, y, z};
      std::memcpy(faces_[axis].data() + face_offset(axis, box, p), at(p), bytes(face.size().x));
    });
  }
  // Then points outside the volume, row by row: the nearest rows are complete before they are copied.
  for_each_row(closed, [&](std::int64_t y, std::int64_t z) {
    const Index3 to{box.low.x, y, z}, from = box.nearest(to);
    if (from != to) std::memcpy(at(to), at(from), bytes(box.size().x));
    for (std::int64_t x = closed.low.x; x < box.low.x; ++x) std::memcpy(at({x, y, z}), at(to), size_);
    for (std::int64_t x = box.high.x + 1; x <= closed.high.x; ++x)
      std::memcpy(at({x, y, z}), at({box.high.x, y, z}), size_);
  });
  return samples;
}

}  // namespace tagrid
