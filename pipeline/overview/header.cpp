#include "pipeline/overview/header.h"

#include <algorithm>

#include "io/metadata/region.h"
#include "io/tag/members.h"

namespace tagrid {
namespace {

// The bound of an overview is a part of the range of the samples if that is looser than the bound of the
// file: far below a level of grey. Means of floats have digits that no sample has.
constexpr double parts_of_range = 65536;

// Overviews are there for slices, and a slice takes complete bricks.
constexpr int largest_edge = 32;

double overview_bound(const CodingParameters& file, const Statistics& total) {
  if (total.finite == 0) return file.max_error;
  const double bound = std::max(file.max_error, total.high / parts_of_range - total.low / parts_of_range);
  return kept_bound(bound, file.type);
}

}  // namespace

TagHeader overview_header(const TagHeader& file, std::int64_t factor, const Statistics& total) {
  TagHeader header = file;
  CodingParameters& p = header.parameters;
  p.dims = overview_dims(file.parameters.dims, factor);
  header.volumes = 1;
  p.grid = GridOrigin::derived;
  p.brick_edge = std::min(p.brick_edge, std::max(1, largest_edge / p.cube_size));
  p.max_error = overview_bound(file.parameters, total);
  p.surface_error = p.mesh_error = -1;
  p.thresholds = {};
  p.filter = {};  // it was fitted to the volume
  header.metadata = metadata_of_overview(file.metadata, factor, file.parameters.dims.z);
  return header;
}

double bytes_besides_bricks(const TagHeader& header) {
  constexpr double bytes_of_end = 300;
  return static_cast<double>(serialize_header(header).size()) + bytes_of_end;
}

}  // namespace tagrid
