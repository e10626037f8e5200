#include "pipeline/verify/against_original.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/errors/errors.h"
#include "pipeline/grid/schedule.h"
#include "stages/brick/sample_statistics.h"
#include "stages/mesh/mesh_error.h"

namespace tagrid {
namespace {

std::string text(Index3 p) { return fmt::format("({}, {}, {})", p.x, p.y, p.z); }

}  // namespace

AgainstOriginal::AgainstOriginal(std::string name, const CodingParameters& parameters,
                                 std::unique_ptr<VolumeSource> original)
    : name_(std::move(name)),
      parameters_(parameters),
      bricks_(parameters.bricks()),
      source_(std::move(original)) {}

double AgainstOriginal::memory(const CodingParameters& p, std::int64_t row_count, std::int64_t threads) {
  const BrickGrid grid = p.bricks();
  const auto edge = static_cast<double>(grid.length()), sample = static_cast<double>(size_of(p.type)),
             bricks = static_cast<double>(row_count) * static_cast<double>(grid.bricks(0));
  const Box closed = grid.closed_box({0, 0, 0});
  const double points = static_cast<double>(closed.count()) * sample, bits = memory_of_activity(p);
  const double slice = static_cast<double>(p.dims.x) *
                       std::min(static_cast<double>(p.dims.y), static_cast<double>(row_count) * edge + 1) *
                       sample;
  // A slice of the original, and of the file.
  double bytes = 2 * slice;
  if (p.surface_error >= 0) bytes += bricks * bits;
  // Bricks wait for the original samples of their layer.
  if (p.mesh_error >= 0)
    bytes += bricks * (bits + 2 * points) + slice * std::min(static_cast<double>(p.dims.z), edge + 1) +
             static_cast<double>(threads) *
                 (points + static_cast<double>(working_bytes_of_mesh_error(p.type, closed.size())));
  return bytes;
}

void AgainstOriginal::compare(const DecodedRows& rows, Statistics& errors) {
  const bool keep = !meshes_.empty();
  original_.resize(keep ? rows.bytes() : rows.slice_bytes());
  decoded_.resize(rows.slice_bytes());
  rows_ = rows.box();
  for (rows_.low.z = rows.box().low.z; rows_.low.z <= rows.box().high.z; ++rows_.low.z) {
    rows_.high.z = rows_.low.z;
    std::byte* slice =
        original_.data() +
        (keep ? static_cast<std::size_t>(rows_.low.z - rows.box().low.z) * rows.slice_bytes() : 0);
    source_->read_rows(slice, bricks_.domain.samples_at(rows_));
    rows.copy_slice(rows_.low.z, decoded_);
    with_sample_type(parameters_.type, [&](auto type) {
      using T = decltype(type);
      compare_slice(reinterpret_cast<const T*>(slice), reinterpret_cast<const T*>(decoded_.data()), errors);
    });
  }
  active_.clear();
  std::vector<double> of_meshes(meshes_.size());
  oneapi::tbb::parallel_for(std::size_t{0}, meshes_.size(),
                            [&](std::size_t i) { of_meshes[i] = mesh_error(meshes_[i], rows.box()); });
  for (const double error : of_meshes) errors.mesh_error = std::max(errors.mesh_error, error);
  meshes_.clear();
}

double AgainstOriginal::mesh_error(const BrickMesh& mesh, const Box& rows) const {
  double error = 0;
  with_sample_type(parameters_.type, [&](auto type) {
    using T = decltype(type);
    const std::span<const T> values(reinterpret_cast<const T*>(mesh.values.data()),
                                    mesh.values.size() / sizeof(T));
    const Samples<T> original{rows, reinterpret_cast<const T*>(original_.data())};
    error = largest_mesh_error<T>(values, mesh.active, original, bricks_.owned_box(mesh.position),
                                  bricks_.domain.volume(), parameters_.cube_size);
  });
  return error;
}

void AgainstOriginal::finish() {
  if (source_->traits().any_rows) source_->seek_slice(parameters_.dims.z);
  source_->finish();
}

template <class T>
void AgainstOriginal::compare_slice(const T* original, const T* decoded, Statistics& errors) const {
  const double bound = parameters_.max_error < 0 ? INFINITY : parameters_.max_error;
  const double tightest = parameters_.surface_error < 0 ? bound : parameters_.surface_error;
  for (std::int64_t i = 0; i < rows_.count(); ++i) {
    const double error = sample_error(original[i], decoded[i]);
    errors.max_error = std::max(errors.max_error, error);
    if constexpr (std::is_integral_v<T>)
      errors.sum_squared_error += static_cast<Uint128>(error) * static_cast<Uint128>(error);
    else if (std::isfinite(original[i]))
      errors.sum_squared_real = Statistics::limited(errors.sum_squared_real + error * error);
    errors.finite += is_finite(original[i]);
    check_sides(original[i], decoded[i], i);
    if (error <= tightest) continue;
    if (error > bound || is_active(point_of(i)))
      throw BrokenInput("{}: voxel {} is {}, but {} in the original; they differ by more than {}", name_,
                        text(point_of(i) - bricks_.domain.first()), +decoded[i], +original[i],
                        error > bound ? bound : tightest);
  }
}

template <class T>
void AgainstOriginal::check_sides(T original, T decoded, std::int64_t number) const {
  for (const double threshold : parameters_.thresholds.numbers()) {
    const auto least = static_cast<T>(threshold);
    if ((original >= least) != (decoded >= least))
      throw BrokenInput("{}: voxel {} is {}, but {} in the original, on the other side of the threshold {}",
                        name_, text(point_of(number) - bricks_.domain.first()), +decoded, +original, +least);
  }
}

// The point of a sample of `rows_`.
Index3 AgainstOriginal::point_of(std::int64_t number) const {
  return rows_.low + Index3{number % parameters_.dims.x, number / parameters_.dims.x, 0};
}

bool AgainstOriginal::is_active(Index3 p) const {
  if (active_.empty()) return false;
  const std::int64_t row = bricks_.owner(p.y) - bricks_.owner(rows_.low.y);
  return active_[static_cast<std::size_t>(row * bricks_.bricks(0) + bricks_.owner(p.x))].test(p);
}

}  // namespace tagrid
