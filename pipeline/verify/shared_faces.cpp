#include "pipeline/verify/shared_faces.h"

#include <cassert>
#include <cstring>

#include "io/bytes/checksum.h"

namespace tagrid {

SharedFaces::Face SharedFaces::cut(const DecodedBrick& brick, const Box& face) const {
  Face result{LatticeBits(face), {}};
  copy_bits(brick.active, result.active);
  if (brick.points.empty()) return result;
  const Box& box = brick.active.box();
  const std::size_t row = static_cast<std::size_t>(face.size().x) * size_;
  for (std::int64_t z = face.low.z; z <= face.high.z; ++z)
    for (std::int64_t y = face.low.y; y <= face.high.y; ++y) {
      const std::byte* from =
          brick.points.data() + static_cast<std::size_t>(box.offset({face.low.x, y, z})) * size_;
      result.points.insert(result.points.end(), from, from + row);
    }
  return result;
}

// Values of inactive points are zero on both sides.
std::optional<Index3> SharedFaces::compare(const Face& a, const Face& b, std::size_t sample_size) {
  if (a.active == b.active && a.points == b.points) return std::nullopt;
  const Box& box = a.active.box();
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) {
        const Index3 p{x, y, z};
        if (a.active.test(p) != b.active.test(p)) return p;
        const std::size_t at = static_cast<std::size_t>(box.offset(p)) * sample_size;
        if (!a.points.empty() && std::memcmp(a.points.data() + at, b.points.data() + at, sample_size) != 0)
          return p;
      }
  return box.low;
}

std::optional<Index3> SharedFaces::first_difference(const DecodedBrick& brick) {
  const Index3 position = bricks_.position(brick.id);
  const Box& box = brick.active.box();
  std::optional<Index3> different;
  for (int axis = 0; axis < 3; ++axis) {
    Box face = box;
    if (position[axis] > 0) {
      face.high[axis] = box.low[axis];
      const auto below = high_faces_.find({bricks_.id(position - unit_vector(axis)), axis});
      if (below == high_faces_.end()) {
        open_low_faces_.push_back(
            {bricks_.id(position - unit_vector(axis)), axis, checksum(cut(brick, face))});
      } else {
        if (!different) different = compare(below->second, cut(brick, face), size_);
        high_faces_.erase(below);
      }
    }
    if (position[axis] + 1 < bricks_.bricks(axis)) {
      face = box;
      face.low[axis] = box.high[axis];
      high_faces_.emplace(std::pair{brick.id, axis}, cut(brick, face));
    }
  }
  return different;
}

std::uint64_t SharedFaces::checksum(const Face& face) {
  return checksum_of({std::as_bytes(face.active.words()), face.points});
}

std::vector<OpenFace> SharedFaces::open_faces() const {
  std::vector<OpenFace> open = open_low_faces_;
  for (const auto& [at, face] : high_faces_) open.push_back({at.first, at.second, checksum(face)});
  return open;
}

void OpenFacePairs::add(const std::vector<OpenFace>& faces) {
  for (const OpenFace& face : faces) {
    const auto [other, is_first] = waiting_.emplace(std::pair{face.below, face.axis}, face.checksum);
    if (is_first) continue;
    const std::int64_t above = bricks_.id(bricks_.position(face.below) + unit_vector(face.axis));
    // For one brick, the x face comes before the y and z faces, as when one process compares them.
    if (other->second != face.checksum &&
        (!first_ || above < first_->above || (above == first_->above && face.below > first_->below)))
      first_ = {face.below, above};
    waiting_.erase(other);
  }
}

std::optional<Disagreement> OpenFacePairs::first_difference() const {
  assert(waiting_.empty());
  return first_;
}

}  // namespace tagrid
