// The first bytes of the input say how the rest is to be read:
//   0 sample type (two low bits, the highest), mode, cube size, root cubes an edge    1 level limit, effort
//   2 3 4 dims    5 largest error of voxels or points    6 that of active voxels    7 number of the brick 8 9
//   bytes of the activity
// Bricks are small, at most 9 points an edge: many runs a second.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <vector>

#include "stages/activity/coding.h"
#include "stages/brick/codec.h"
#include "stages/grid/conformity.h"
#include "stages/grid/lattice.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {
namespace {

constexpr std::size_t head_size = 10;

CodingParameters parameters_of(Bytes head) {
  constexpr std::array types = {SampleType::uint8,   SampleType::int8,   SampleType::uint16,
                                SampleType::int16,   SampleType::uint32, SampleType::int32,
                                SampleType::float32, SampleType::float64};
  CodingParameters p;
  p.type = types[(head[0] & 3) | (head[0] & 128) >> 5];
  p.mode = (head[0] & 4) ? FileMode::grid : FileMode::voxels;
  p.cube_size = (head[0] & 8) ? 8 : 4;
  p.brick_edge = (head[0] & 24) == 16 ? 2 : 1;
  p.max_level = std::min<int>(head[1] % 64, max_level(p.cube_size));
  p.effort = static_cast<Effort>(head[1] / 64 % 3);
  for (int axis = 0; axis < 3; ++axis) p.dims[axis] = 1 + head[static_cast<std::size_t>(2 + axis)] % 20;
  p.field_scale = 1;
  p.max_error = head[5];
  p.point_error = head[5];
  if (p.mode == FileMode::voxels && head[6] < head[5]) p.surface_error = head[6];
  if (head[1] / 64 == 3 && p.mode == FileMode::voxels && p.max_error >= 1) {
    p.surface_error = -1;
    p.transform_step = (1u << head[6] % 23) * least_transform_step;
    if (head[6] >= 128) p.filter.fill(static_cast<std::int16_t>(head[6] - 191));
  }
  if (head[4] >= 240 && p.mode == FileMode::voxels)
    for (const double threshold : {16.0, 200.0})
      if (threshold_of(threshold, p.type) == threshold) p.thresholds.append(threshold);
  return p;
}

void activity_comes_back(const LatticeBits& active, const CodingParameters& p) {
  claim(!first_nonconforming_point(active, active.box(), p.cube_size), "activity is closed under parents");
  std::vector<std::uint8_t> bytes;
  encode_activity(active, {}, p.cube_size, p.max_level, bytes);
  LatticeBits again(active.box());
  claim(decode_activity(bytes, {}, p.cube_size, p.max_level, again).ok(),
        "activity that was written is read");
  claim(again == active, "activity comes back");
}

/// True if `value` is within the bound of `original`. If `original` is not finite, or the bound is 0, all
/// bits must be equal.
template <class T>
bool is_within(T value, T original, double error) {
  if (std::memcmp(&value, &original, sizeof value) == 0) return true;
  if constexpr (std::is_floating_point_v<T>)
    if (!std::isfinite(value) || !std::isfinite(original)) return false;
  return error > 0 && std::abs(static_cast<long double>(value) - static_cast<long double>(original)) <= error;
}

std::size_t samples_of(const CodingParameters& p, Index3 position) {
  return static_cast<std::size_t>(p.bricks().owned_box(position).count());
}
std::size_t count_of_points(const CodingParameters& p, Index3 position) {
  return p.mode == FileMode::grid ? static_cast<std::size_t>(p.bricks().closed_box(position).count()) : 0;
}

/// What was decoded, of the box that encode_brick() wants, is encoded again.
template <class T>
void values_come_back(const std::vector<T>& values, const LatticeBits& active, const CodingParameters& given,
                      Index3 position) {
  const bool grid = given.mode == FileMode::grid;
  const Box box = samples_to_encode(given, position);
  const double bound = grid ? given.point_error : given.max_error;
  for (const double error : {0.0, bound}) {
    CodingParameters p = given;
    (grid ? p.point_error : p.max_error) = error;
    if (grid) p.max_error = -1;
    if (error == 0) p.surface_error = -1;
    BrickCode code;
    encode_brick<T>({box, values.data()}, active, p, position, code);
    std::vector<T> samples(samples_of(p, position)), points(count_of_points(p, position));
    std::vector<std::uint8_t> activity;
    claim(decode_brick_values<T>(code.values, active, p, position, {samples, points, activity}).ok(),
          "values that were written are read");
    activity.insert(activity.end(), code.activity.begin(), code.activity.end());
    LatticeBits active_again;
    claim(decode_brick_activity<T>(activity, samples, p, position, active_again).ok(),
          "the activity of a brick that was written is read");
    claim(active_again == active, "the activity of a brick comes back");
    const std::vector<T>& again = grid ? points : samples;
    claim(again.size() == values.size(), "as many values come back");
    std::size_t i = 0;
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
        for (std::int64_t x = box.low.x; x <= box.high.x; ++x, ++i)
          claim((grid && !active.test({x, y, z})) || is_within(again[i], values[i], error),
                "every value is within its bound");
  }
}

/// The first slices of a brick that can be decoded can be decoded alone.
template <class T>
void begins_the_same(Bytes values, const LatticeBits& active, const CodingParameters& p, Index3 position,
                     const std::vector<T>& whole, std::int64_t number) {
  if (p.mode == FileMode::grid) return;
  const Index3 size = p.bricks().owned_box(position).size();
  std::vector<T> samples(static_cast<std::size_t>(size.x * size.y * (1 + number % size.z))), points;
  std::vector<std::uint8_t> carried;
  claim(decode_brick_values<T>(values, active, p, position, {samples, points, carried}).ok(),
        "the first slices of a brick can be decoded alone");
  claim(std::memcmp(samples.data(), whole.data(), samples.size() * sizeof(T)) == 0,
        "the first slices of a brick are the same alone");
}

}  // namespace

void brick(Bytes bytes) {
  if (bytes.size() < head_size) return;
  const Bytes head = bytes.first(head_size), rest = bytes.subspan(head_size);
  const CodingParameters p = parameters_of(head);
  const Index3 position = p.bricks().position(head[7] % p.bricks().count());
  const std::size_t activity_size = std::min<std::size_t>(rest.size(), head[8] | head[9] << 8);
  const Bytes values = rest.subspan(activity_size);
  std::vector<std::uint8_t> carried,
      activity(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(activity_size));
  with_sample_type(p.type, [&](auto type) {
    using T = decltype(type);
    LatticeBits active;
    // Where there are no values, they do not keep the activity from being read.
    std::vector<T> samples(samples_of(p, position)), points(count_of_points(p, position));
    const bool values_first = activity_follows_values(p);
    const auto decode_values = [&] {
      const bool is_decoded =
          decode_brick_values<T>(values, active, p, position, {samples, points, carried}).ok();
      if (is_decoded) begins_the_same<T>(values, active, p, position, samples, head[8]);
      return is_decoded;
    };
    if (values_first && !values.empty() && !decode_values()) return;
    activity.insert(activity.begin(), carried.begin(), carried.end());
    if (!decode_brick_activity<T>(activity, samples, p, position, active).ok()) return;
    // Most inputs break in the values. Encoding the activity again is worth its time only if they do not, or
    // if there are no values.
    if (values.empty()) activity_comes_back(active, p);
    Statistics statistics;
    count_active(active, p, position, statistics);
    if (values.empty() || (!values_first && !decode_values())) return;
    activity_comes_back(active, p);
    values_come_back<T>(p.mode == FileMode::voxels ? samples : points, active, p, position);
  });
}

}  // namespace tagrid::fuzz
