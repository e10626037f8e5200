#include "pipeline/encode/overviews.h"

#include <utility>

#include "io/tag/members.h"
#include "pipeline/encode/graph.h"
#include "pipeline/memory/plan.h"
#include "pipeline/overview/block_means.h"
#include "pipeline/overview/header.h"
#include "pipeline/slices/slices_ahead.h"

namespace tagrid {

namespace {

// Of an overview: its samples are not progress of the volume.
class WatchOfOverview : public Watch {
 public:
  explicit WatchOfOverview(Watch& volume) : volume_(volume) {}
  void before_reading() override { volume_.before_reading(); }

 private:
  Watch& volume_;
};

}  // namespace

void write_overviews(const TagHeader& file, const std::vector<int>& factors, const Statistics& total,
                     SumsFile sums, const Resources& resources, const std::string& output, MemberSink& out,
                     Watch& watch) {
  WatchOfOverview of_overview(watch);
  const Index3 dims = file.parameters.dims;
  for (const int factor : factors) {
    while (sums.layout().factor < factor) sums = coarser(sums, dims, resources.spool.value(), output);
    EncodeJob job{.header = overview_header(file, factor, total)};
    const CodingParameters& p = job.parameters();
    job.plan = plan_encoding(p, resources, true, {.besides = sums.layout().row_bytes()});
    SpoolFile encoded = SpoolFile::in(resources.spool.value(), output);
    SpoolSink sink(encoded);
    TagWriter writer(sink, job.header);
    MeansSource means(sums, dims);
    SlicesAhead slices(means, 0);
    encode(job, BrickRows::all(p.bricks()), slices, writer, of_overview);
    writer.finish();
    out.write_member(overview_kind, static_cast<std::uint32_t>(factor), encoded);
  }
}

OverviewsOfStream::OverviewsOfStream(TagHeader header, std::vector<int> factors, const Resources& resources,
                                     std::string output)
    : header_(std::move(header)),
      factors_(std::move(factors)),
      resources_(resources),
      output_(std::move(output)) {
  const CodingParameters& p = header_.parameters;
  if (!factors_.empty())
    sums_.emplace(layout_of_sums(p.dims, p.type, block_edge), resources_.spool.value(), output_);
}

void OverviewsOfStream::write(TagWriter& writer, Watch& watch) {
  if (!sums_) return;
  write_overviews(header_, factors_, writer.index().total, std::move(*sums_), resources_, output_, writer,
                  watch);
  sums_.reset();
}

}  // namespace tagrid
