#include "stages/brick/codec.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <optional>
#include <vector>

#include "stages/activity/coding.h"
#include "stages/activity/forecast.h"
#include "stages/bound/bounds.h"
#include "stages/brick/sample_statistics.h"
#include "stages/grid/lattice.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/vector_code.h"
#include "stages/values/points/coding.h"
#include "stages/values/points/field.h"
#include "stages/values/sides/sides.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/wide/codec.h"

namespace tagrid {
namespace {

// Its type selects the coder of narrow or of wide types.
template <class T>
auto voxels_of(const Box& owned, const LatticeBits& active, const CodingParameters& parameters,
               FilterSums* sums = nullptr) {
  if constexpr (is_wide<T>)
    return WideBrick{owned,
                     &active,
                     {parameters.max_error, parameters.surface_error},
                     parameters.effort,
                     parameters.transform_step,
                     parameters.filter,
                     sums};
  else
    return VoxelBrick{owned,
                      &active,
                      {integer_bound<T>(parameters.max_error), integer_bound<T>(parameters.surface_error)},
                      parameters.effort,
                      parameters.transform_step,
                      parameters.filter,
                      sums};
}

// The values of `box` that lie in `owned`.
template <class T>
void cut(std::span<const T> values, const Box& box, const Box& owned, std::span<T> out) {
  auto to = out.begin();
  for (std::int64_t z = owned.low.z; z <= owned.high.z; ++z)
    for (std::int64_t y = owned.low.y; y <= owned.high.y; ++y)
      to = std::copy_n(values.begin() + box.offset({owned.low.x, y, z}), owned.size().x, to);
}

// All samples that the brick owns, interpolated from the values of its active points.
template <class T>
void interpolate_owned(std::span<const T> points, const LatticeBits& active,
                       const CodingParameters& parameters, Index3 brick, std::span<T> out) {
  const auto field = interpolate_points<T>(points, active, parameters.cube_size);
  const std::vector<T> samples = rounded_field<T>(field, points, active, parameters.cube_size);
  cut<T>(samples, active.box(), parameters.bricks().owned_box(brick), out);
}

template <class T>
std::vector<std::byte> bytes_of(std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  return {bytes.begin(), bytes.end()};
}

// The forecast from decoded samples, if these do not depend on the activity.
template <class T>
Forecast forecast_of(std::span<const T> samples, const CodingParameters& parameters, Index3 brick) {
  if (!activity_follows_values(parameters)) return {};
  return forecast_activity<T>(samples, parameters, brick);
}

// Values that begin with this byte and a length have the sides of thresholds first, of this length.
constexpr std::uint8_t kind_of_sides = 10;
constexpr std::size_t head_of_sides = 1 + 4;

void put_before(const std::vector<std::uint8_t>& sides, std::vector<std::uint8_t>& values) {
  if (sides.empty()) return;
  std::vector<std::uint8_t> whole = {kind_of_sides};
  for (int byte = 0; byte < 4; ++byte) whole.push_back(static_cast<std::uint8_t>(sides.size() >> 8 * byte));
  whole.insert(whole.end(), sides.begin(), sides.end());
  values.insert(values.begin(), whole.begin(), whole.end());
}

// Takes the sides off the front of the values; empty if there are none.
Status take_sides(std::span<const std::uint8_t>& values, std::span<const std::uint8_t>& sides) {
  if (values.empty() || values.front() != kind_of_sides) return {};
  std::size_t length = 0;
  for (std::size_t byte = 0; byte < 4 && values.size() >= head_of_sides; ++byte)
    length |= std::size_t{values[1 + byte]} << 8 * byte;
  if (length == 0 || length > values.size() - head_of_sides)
    return Status::broken("the sides of thresholds have an impossible length");
  sides = values.subspan(head_of_sides, length);
  values = values.subspan(head_of_sides + length);
  return {};
}

// Of a file with voxels.
template <class T>
void encode_voxels_and_activity(const Samples<T>& samples, const LatticeBits& active,
                                const CodingParameters& parameters, Index3 brick, BrickCode& code) {
  const auto n = static_cast<std::size_t>(samples.box.count());
  std::vector<T> decoded(n);
  const auto code_activity = [&] {
    code.activity.clear();
    encode_activity(active, forecast_of<T>(decoded, parameters, brick), parameters.cube_size,
                    parameters.max_level, code.activity);
  };
  const std::span<const T> original(samples.data, n);
  auto values = encode_voxels<T>(
      original,
      voxels_of<T>(samples.box, active, parameters, code.filter_sums ? &*code.filter_sums : nullptr), decoded,
      code.values);
  std::vector<std::uint8_t> sides;
  encode_sides<T>(original, parameters.thresholds, decoded, code.statistics.moved, sides);
  if (!parameters.stores_activity()) {
    values.finish();
  } else if (activity_follows_values(parameters)) {
    // What a decoder needs after the values, the values can carry.
    code_activity();
    const std::optional<std::size_t> carried = values.finish(code.activity);
    if (!carried) code_activity();
    code.activity.erase(code.activity.begin(),
                        code.activity.begin() + static_cast<std::ptrdiff_t>(carried.value_or(0)));
  } else {
    values.finish();
    code_activity();
  }
  put_before(sides, code.values);
  measure_samples<T>(original, decoded, parameters.thresholds, code.statistics);
  if (parameters.mesh_error >= 0) code.decoded = bytes_of<T>(decoded);
}

// Of a file without voxels.
template <class T>
void encode_points_and_activity(const Samples<T>& samples, const LatticeBits& active,
                                const CodingParameters& parameters, Index3 brick, BrickCode& code) {
  const std::span<const T> original(samples.data, static_cast<std::size_t>(samples.box.count()));
  encode_activity(active, {}, parameters.cube_size, parameters.max_level, code.activity);
  std::vector<T> points(original.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = stored_point(original[i], parameters.point_error);
  encode_points<T>(points, active, parameters.cube_size, parameters.point_error, code.values);
  if (parameters.mesh_error >= 0) code.decoded = bytes_of<T>(points);
  const Box box = parameters.bricks().owned_box(brick);
  std::vector<T> owned(static_cast<std::size_t>(box.count())), interpolated(owned.size());
  cut<T>(original, samples.box, box, owned);
  interpolate_owned<T>(points, active, parameters, brick, interpolated);
  measure_samples<T>(owned, interpolated, {}, code.statistics);
}

}  // namespace

bool activity_follows_values(const CodingParameters& parameters) {
  return parameters.mode == FileMode::voxels && parameters.surface_error < 0;
}

Box samples_to_encode(const CodingParameters& parameters, Index3 brick) {
  const BrickGrid bricks = parameters.bricks();
  return parameters.mode == FileMode::grid ? bricks.closed_box(brick) : bricks.owned_box(brick);
}

template <class T>
void encode_brick(const Samples<T>& samples, const LatticeBits& active, const CodingParameters& parameters,
                  Index3 brick, BrickCode& code) {
  assert(samples.box == samples_to_encode(parameters, brick));
  if (parameters.counts_points()) count_active(active, parameters, brick, code.statistics);
  if (parameters.mode == FileMode::voxels)
    encode_voxels_and_activity(samples, active, parameters, brick, code);
  else
    encode_points_and_activity(samples, active, parameters, brick, code);
  check_bound(code.statistics, parameters);
}

void encode_brick(const BrickSamples& samples, const LatticeBits& active, const CodingParameters& parameters,
                  Index3 brick, BrickCode& code) {
  with_sample_type(parameters.type, [&](auto type) {
    encode_brick(samples.as<decltype(type)>(), active, parameters, brick, code);
  });
}

template <class T>
Status decode_brick_activity(std::span<const std::uint8_t> bytes, std::span<const T> samples,
                             const CodingParameters& parameters, Index3 brick, LatticeBits& active) {
  active = LatticeBits(parameters.bricks().closed_box(brick));
  return decode_activity(bytes, forecast_of<T>(samples, parameters, brick), parameters.cube_size,
                         parameters.max_level, active);
}

template <class T>
Status decode_brick_values(std::span<const std::uint8_t> bytes, const LatticeBits& active,
                           const CodingParameters& parameters, Index3 brick, const BrickValues<T>& values) {
  const Box owned = parameters.bricks().owned_box(brick);
  if (parameters.mode == FileMode::voxels) {
    std::span<const std::uint8_t> sides;
    if (parameters.thresholds.count > 0)
      if (Status status = take_sides(bytes, sides); !status.ok()) return status;
    Status status =
        decode_voxels<T>(bytes, voxels_of<T>(owned, active, parameters), values.samples, values.carried);
    const bool are_all = static_cast<std::int64_t>(values.samples.size()) == owned.count();
    if (status.ok() && !sides.empty())
      status = decode_sides<T>(sides, parameters.thresholds, are_all, values.samples);
    return status;
  }
  assert(static_cast<std::int64_t>(values.samples.size()) == owned.count());
  assert(active.box() == parameters.bricks().closed_box(brick));
  Status status =
      decode_points<T>(bytes, active, parameters.cube_size, parameters.point_error, values.points);
  if (status.ok()) interpolate_owned<T>(values.points, active, parameters, brick, values.samples);
  return status;
}

#define TAGRID_INSTANTIATE(T)                                                                        \
  template void encode_brick(const Samples<T>&, const LatticeBits&, const CodingParameters&, Index3, \
                             BrickCode&);                                                            \
  template Status decode_brick_activity(std::span<const std::uint8_t>, std::span<const T>,           \
                                        const CodingParameters&, Index3, LatticeBits&);              \
  template Status decode_brick_values(std::span<const std::uint8_t>, const LatticeBits&,             \
                                      const CodingParameters&, Index3, const BrickValues<T>&);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

TAGRID_VECTOR_CODE
void count_active(const LatticeBits& active, const CodingParameters& parameters, Index3 brick,
                  Statistics& statistics) {
  Box owned = active.box();
  for (int axis = 0; axis < 3; ++axis)
    if (brick[axis] > 0) ++owned.low[axis];
  const std::int64_t s = parameters.cube_size;
  // The x coordinates with exactly 2^i as their unit, and those with 2^i or more; the multiples of S are at
  // the end.
  const std::size_t words = active.words_per_row();
  struct Masks {
    std::vector<std::uint64_t> exactly, at_least;
  };
  std::vector<Masks> masks;
  for (std::int64_t unit = 1; unit <= s; unit *= 2) {
    Masks& m =
        masks.emplace_back(Masks{std::vector<std::uint64_t>(words), std::vector<std::uint64_t>(words)});
    for (std::int64_t x = owned.low.x; x <= owned.high.x; ++x) {
      const auto at = static_cast<std::size_t>(x - active.box().low.x);
      const std::uint64_t bit = std::uint64_t{x % unit == 0} << (at % 64);
      m.at_least[at / 64] |= bit;
      if (unit == s || x % (2 * unit) != 0) m.exactly[at / 64] |= bit;
    }
  }
  for (std::int64_t z = owned.low.z; z <= owned.high.z; ++z)
    for (std::int64_t y = owned.low.y; y <= owned.high.y; ++y) {
      const std::uint64_t* row = active.row(y, z);
      const auto count = [&](const std::vector<std::uint64_t>& mask, std::int64_t x) {
        std::uint64_t n = 0;
        for (std::size_t w = 0; w < words; ++w)
          n += static_cast<std::uint64_t>(std::popcount(row[w] & mask[w]));
        if (n > 0)
          statistics.active[static_cast<std::size_t>(classify({x, y, z}, parameters.cube_size).level)] += n;
      };
      // Points whose x has a larger unit than y or z have all the same level.
      const auto last = static_cast<std::size_t>(std::countr_zero(static_cast<std::uint64_t>(y | z | s)));
      for (std::size_t i = 0; i <= last; ++i) count(masks[i].exactly, std::int64_t{1} << i);
      if (last + 1 < masks.size()) count(masks[last + 1].at_least, s);
    }
}

namespace {

// The samples that lie in some bytes.
template <class T>
std::span<T> samples_in(std::vector<std::byte>& bytes) {
  return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
}

/// The samples of a brick, and the activity if they need it. `carried` receives the bytes of the activity
/// that the values carry.
Status decode_values(BrickCodeView code, const CodingParameters& parameters, std::int64_t id,
                     std::int64_t slices, DecodedBrick& brick, std::vector<std::uint8_t>& carried) {
  assert(slices > 0);
  const BrickGrid bricks = parameters.bricks();
  const Index3 position = bricks.position(id);
  const bool values_first = activity_follows_values(parameters);
  brick = {};
  brick.id = id;
  if (!parameters.stores_activity() && !code.activity.empty())
    return Status::broken("a brick has a grid, but the file stores none");
  if (!values_first) {
    brick.active = LatticeBits(bricks.closed_box(position));
    if (Status status =
            decode_activity(code.activity, parameters.cube_size, parameters.max_level, brick.active);
        !status.ok())
      return status;
  }
  const auto bytes_of = [&](const Box& box) {
    return std::vector<std::byte>(static_cast<std::size_t>(box.count()) * size_of(parameters.type));
  };
  Box returned = bricks.owned_box(position);
  if (parameters.mode == FileMode::voxels)
    returned.high.z = returned.low.z + std::min(slices, returned.size().z) - 1;
  brick.samples = bytes_of(returned);
  if (parameters.mode == FileMode::grid) brick.points = bytes_of(bricks.closed_box(position));
  Status status;
  with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    status = decode_brick_values<T>(code.values, brick.active, parameters, position,
                                    {samples_in<T>(brick.samples), samples_in<T>(brick.points), carried});
  });
  if (status.ok() && !carried.empty() && !(values_first && parameters.stores_activity()))
    return Status::broken("the values carry bytes of an activity that does not follow them");
  return status;
}

}  // namespace

Status decode_brick_samples(BrickCodeView code, const CodingParameters& parameters, std::int64_t id,
                            std::int64_t slices, DecodedBrick& brick) {
  std::vector<std::uint8_t> carried;
  const Status status = decode_values(code, parameters, id, slices, brick, carried);
  brick.points = std::vector<std::byte>();  // "{}" would keep the memory
  brick.active = LatticeBits();
  return status;
}

Status decode_brick(BrickCodeView code, const CodingParameters& parameters, BrickRequest request,
                    DecodedBrick& brick) {
  if (request.wanted == Wanted::samples)
    return decode_brick_samples(code, parameters, request.id, request.slices, brick);
  assert(request.slices == all_slices);
  std::vector<std::uint8_t> carried;
  Status status = decode_values(code, parameters, request.id, all_slices, brick, carried);
  if (!status.ok() || !activity_follows_values(parameters) || !parameters.stores_activity()) return status;
  carried.insert(carried.end(), code.activity.begin(), code.activity.end());
  with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    status = decode_brick_activity<T>(carried, samples_in<T>(brick.samples), parameters,
                                      parameters.bricks().position(request.id), brick.active);
  });
  return status;
}

// Adds up the working bytes of the stages of a brick. Each stage declares its own.

namespace {

struct Sizes {
  Sizes(const CodingParameters& parameters, Index3 brick)
      : type(parameters.type),
        wide(is_wide_type(type)),
        grid(parameters.mode == FileMode::grid),
        closed(parameters.bricks().closed_box(brick).size()),
        owned(parameters.bricks().owned_box(brick).size()),
        points(count(closed)),
        voxels(count(owned)),
        point_bytes(points * size_of(type)),
        voxel_bytes(voxels * size_of(type)) {}

  static std::uint64_t count(const Index3& n) { return static_cast<std::uint64_t>(n.x * n.y * n.z); }

  SampleType type;
  bool wide, grid;
  Index3 closed, owned;
  std::uint64_t points, voxels, point_bytes, voxel_bytes;
};

// The field, and a copy of it as samples.
std::uint64_t interpolation(const Sizes& z) { return z.points * field_number_bytes(z.type) + z.point_bytes; }

// The forecast is finished before the activity is coded.
std::uint64_t with_forecast(const Sizes& z, const CodingParameters& parameters, std::uint64_t activity) {
  if (!activity_follows_values(parameters)) return activity;
  return std::max(working_bytes_of_forecast(z.type, z.closed, parameters.cube_size),
                  Forecast::working_bytes(z.closed) + activity);
}

std::uint64_t most_bytes_of_activity(const Sizes& z) { return z.points / 5; }

// The rows of bits that count_active() makes.
constexpr std::uint64_t counting = 16384;

}  // namespace

std::uint64_t working_bytes_of_encoding(const CodingParameters& p, Index3 brick) {
  const Sizes z(p, brick);
  const std::uint64_t code = most_bytes_of_code(p, brick),
                      activity = working_bytes_of_encoding_activity(z.closed, activity_follows_values(p));
  const std::uint64_t decoded = p.mesh_error >= 0 ? z.point_bytes : 0;
  if (z.grid) {
    const std::uint64_t values = working_bytes_of_encoding_points(z.type, z.closed);
    return counting +
           std::max(activity, z.point_bytes + std::max(values + code, code + decoded + 2 * z.voxel_bytes +
                                                                          interpolation(z)));
  }
  const WideBounds bounds = {p.max_error, p.surface_error};
  const std::uint64_t values =
      z.wide ? working_bytes_of_encoding_wide_voxels(z.type, z.owned, bounds, p.effort, p.transform_step > 0)
             : working_bytes_of_encoding_voxels(z.type, z.owned, p.effort, p.transform_step > 0);
  // The activity is coded before the values are finished. Wide samples are then numbers of 16 bits.
  const std::uint64_t pending =
      z.wide ? z.voxels * sizeof(std::uint16_t) +
                   working_bytes_of_pending_voxels(SampleType::uint16, z.owned, p.effort)
             : working_bytes_of_pending_voxels(z.type, z.owned, p.effort);
  const std::uint64_t carried = p.stores_activity() && activity_follows_values(p) ? pending : 0;
  // The sides are found next to values that are finished, but for the bytes that they may carry, and put before them.
  const std::uint64_t of_sides =
      p.thresholds.count == 0
          ? 0
          : std::max(code, pending) + working_bytes_of_sides(z.voxels, p.thresholds.count);
  return counting + z.voxel_bytes +
         std::max(
             {values, std::max(code, carried) + with_forecast(z, p, activity), code + decoded, of_sides});
}

std::uint64_t most_bytes_of_code(const CodingParameters& p, Index3 brick) {
  const Sizes z(p, brick);
  // The side of a threshold is one event of a model that learns, hardly more than one bit.
  const std::uint64_t of_sides = z.grid ? 0 : z.voxels * p.thresholds.count / 7;
  return (z.grid ? z.point_bytes : z.voxel_bytes) * 21 / 20 + most_bytes_of_activity(z) + of_sides + 1024;
}

std::uint64_t working_bytes_of_decoding(const CodingParameters& p, Index3 brick, Wanted wanted) {
  const Sizes z(p, brick);
  const bool grid = wanted == Wanted::samples_and_grid;
  const std::uint64_t bits = LatticeBits::working_bytes(z.closed),
                      activity = working_bytes_of_decoding_activity(z.closed, activity_follows_values(p));
  if (z.grid) {
    const std::uint64_t values = working_bytes_of_decoding_points(z.type, z.closed);
    return bits + std::max(activity, z.point_bytes + z.voxel_bytes + std::max(values, interpolation(z)));
  }
  const std::uint64_t values =
      z.wide ? working_bytes_of_decoding_wide_voxels(z.type, z.owned, p.effort, p.transform_step > 0)
             : working_bytes_of_decoding_voxels(z.type, z.owned, p.effort, p.transform_step > 0);
  if (!activity_follows_values(p)) return bits + std::max(activity, z.voxel_bytes + values);
  if (!grid) return z.voxel_bytes + values;
  // Bytes that were carried are put before the others.
  return z.voxel_bytes + std::max(values, most_bytes_of_activity(z) + bits + with_forecast(z, p, activity));
}

}  // namespace tagrid
