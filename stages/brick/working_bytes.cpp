// Adds up the working bytes of the stages of a brick. Each stage declares its own.
#include <algorithm>

#include "stages/activity/coding.h"
#include "stages/activity/forecast.h"
#include "stages/brick/codec.h"
#include "stages/values/points/coding.h"
#include "stages/values/points/field.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/wide/codec.h"

namespace tagrid {
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
  return counting + z.voxel_bytes +
         std::max({values, std::max(code, carried) + with_forecast(z, p, activity), code + decoded});
}

std::uint64_t most_bytes_of_code(const CodingParameters& p, Index3 brick) {
  const Sizes z(p, brick);
  return (z.grid ? z.point_bytes : z.voxel_bytes) * 21 / 20 + most_bytes_of_activity(z) + 1024;
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
