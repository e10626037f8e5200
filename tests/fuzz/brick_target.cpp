// The first bytes of the input say how the rest is to be read:
//   0 sample type, mode, cube size, root cubes an edge    1 level limit    2 3 4 dims    5 largest error of
//   voxels or points    6 that of active voxels    7 number of the brick    8 9 bytes of the activity
// Bricks are small, at most 9 points an edge: many runs a second.
#include <algorithm>
#include <array>
#include <vector>

#include "grid/conformity.h"
#include "grid/lattice.h"
#include "stages/activity_coding.h"
#include "stages/brick_codec.h"
#include "stages/point_coding.h"
#include "stages/voxel_codec.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {
namespace {

constexpr std::size_t head_size = 10;

CodingParameters parameters_of(Bytes head) {
  constexpr std::array types = {SampleType::uint8, SampleType::int8, SampleType::uint16, SampleType::int16};
  CodingParameters p;
  p.type = types[head[0] & 3];
  p.mode = (head[0] & 4) ? FileMode::grid : FileMode::voxels;
  p.cube_size = (head[0] & 8) ? 8 : 4;
  p.brick_edge = (head[0] & 24) == 16 ? 2 : 1;
  p.max_level = std::min<int>(head[1], max_level(p.cube_size));
  for (int axis = 0; axis < 3; ++axis) p.dims[axis] = 1 + head[static_cast<std::size_t>(2 + axis)] % 20;
  p.field_scale = 1;
  p.max_error = head[5];
  p.point_error = head[5];
  if (p.mode == FileMode::voxels && head[6] < head[5]) p.surface_error = head[6];
  return p;
}

void activity_comes_back(const LatticeBits& active, const CodingParameters& p) {
  claim(!first_nonconforming_point(active, active.box(), p.cube_size), "activity is closed under parents");
  std::vector<std::uint8_t> bytes;
  encode_activity(active, p.cube_size, p.max_level, bytes);
  LatticeBits again(active.box());
  claim(decode_activity(bytes, p.cube_size, p.max_level, again).ok(), "activity that was written is read");
  claim(again == active, "activity comes back");
}

template <class T>
void voxels_come_back(const std::vector<T>& samples, const LatticeBits& active, const CodingParameters& p,
                      Index3 position) {
  const Box owned = p.bricks().owned_box(position);
  std::vector<T> made(samples.size()), again(samples.size());
  for (const std::int64_t error : {std::int64_t{0}, static_cast<std::int64_t>(p.max_error)}) {
    const VoxelBounds bounds{error, error > 0 ? static_cast<std::int64_t>(p.surface_error) : -1};
    std::vector<std::uint8_t> bytes;
    encode_voxels<T>(samples, owned, active, bounds, bytes, made);
    claim(decode_voxels<T>(bytes, owned, active, bounds, again).ok(), "voxels that were written are read");
    claim(again == made, "voxels are decoded as the encoder said");
    for (std::size_t i = 0; i < samples.size(); ++i)
      claim(std::abs(int{again[i]} - int{samples[i]}) <= error, "every voxel is within its bound");
  }
}

template <class T>
void points_come_back(const std::vector<T>& points, const LatticeBits& active, const CodingParameters& p) {
  for (const std::int64_t error : {std::int64_t{0}, static_cast<std::int64_t>(p.point_error)}) {
    std::vector<T> stored(points), again(points.size());
    const Box& box = active.box();
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
        for (std::int64_t x = box.low.x; x <= box.high.x; ++x) {
          T& point = stored[static_cast<std::size_t>(box.offset({x, y, z}))];
          point = active.test({x, y, z}) ? stored_point(point, error) : T{0};
        }
    claim(error > 0 || stored == points, "points that are not active are zero");
    std::vector<std::uint8_t> bytes;
    encode_points<T>(stored, active, p.cube_size, error, bytes);
    claim(decode_points<T>(bytes, active, p.cube_size, error, again).ok(),
          "points that were written are read");
    claim(again == stored, "points come back");
  }
}

}  // namespace

void brick(Bytes bytes) {
  if (bytes.size() < head_size) return;
  const Bytes head = bytes.first(head_size), rest = bytes.subspan(head_size);
  const CodingParameters p = parameters_of(head);
  const Index3 position = p.bricks().position(head[7] % p.bricks().count());
  const std::size_t activity_size = std::min<std::size_t>(rest.size(), head[8] | head[9] << 8);
  LatticeBits active;
  if (!decode_brick_activity(rest.first(activity_size), p, position, active).ok()) return;
  // Most inputs break in the values: encoding the activity again is worth its time where they do not, or
  // where there are none.
  const Bytes values = rest.subspan(activity_size);
  if (values.empty()) activity_comes_back(active, p);
  Statistics statistics;
  count_active(active, p, position, statistics);
  with_sample_type(p.type, [&](auto type) {
    using T = decltype(type);
    std::vector<T> samples, points;
    if (!decode_brick_values<T>(values, active, p, position, samples, points).ok()) return;
    activity_comes_back(active, p);
    claim(samples.size() == static_cast<std::size_t>(p.bricks().owned_box(position).count()),
          "a brick has the samples that it owns");
    if (p.mode == FileMode::voxels)
      voxels_come_back<T>(samples, active, p, position);
    else
      points_come_back<T>(points, active, p);
  });
}

}  // namespace tagrid::fuzz
