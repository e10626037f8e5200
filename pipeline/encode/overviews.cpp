#include "pipeline/encode/overviews.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/formats/nrrd/region.h"
#include "io/tag/file.h"
#include "io/tag/members.h"
#include "pipeline/encode/graph.h"
#include "pipeline/job/source_survey.h"
#include "pipeline/memory/plan.h"
#include "pipeline/overview/means_source.h"

namespace tagrid {
namespace {

// The bound of an overview is a part of the range of the samples if that is looser than the bound of the file:
// far below a level of grey. Means of floats have digits that no sample has.
constexpr double parts_of_range = 65536;

double overview_bound(const CodingParameters& file, const Statistics& total) {
  if (total.finite == 0) return file.max_error;
  const double bound = std::max(file.max_error, total.high / parts_of_range - total.low / parts_of_range);
  return is_float_type(file.type) ? bound : std::floor(bound);
}

}  // namespace

TagHeader overview_header(const TagHeader& file, std::int64_t factor, const Statistics& total) {
  TagHeader header = file;
  CodingParameters& p = header.parameters;
  p.dims = overview_dims(file.parameters.dims, factor);
  header.volumes = 1;
  p.grid = GridOrigin::derived;
  p.max_error = overview_bound(file.parameters, total);
  p.surface_error = p.mesh_error = -1;
  header.nrrd_fields = fields_of_overview(file.nrrd_fields, factor, file.parameters.dims.z);
  return header;
}

void write_overviews(const TagHeader& file, const std::vector<int>& factors, const Statistics& total,
                     SumsFile sums, const Resources& resources, const std::string& output,
                     const MemberOut& out) {
  const Index3 dims = file.parameters.dims;
  for (const int factor : factors) {
    while (sums.layout().factor < factor) sums = coarser(sums, dims, resources.spool, output);
    const TagHeader header = overview_header(file, factor, total);
    const CodingParameters& p = header.parameters;
    SpoolFile encoded = SpoolFile::in(resources.spool, output);
    SpoolSink sink(encoded);
    TagWriter writer(sink, header);
    MeansSource means(sums, dims);
    RowEncoder(p, plan_encoding(p, resources, true, {.besides = sums.layout().row_bytes()}),
               [&](const Box& rows) { return read_input_slice(means, rows); })
        .encode(BrickRows::all(p.bricks()), writer, watch_for({}, 0));
    writer.finish();
    out(overview_kind, static_cast<std::uint32_t>(factor), encoded.size(),
        [&](const PassBytes& pass) { encoded.read_back([&](std::span<std::byte> bytes) { pass(bytes); }); });
  }
}

}  // namespace tagrid
