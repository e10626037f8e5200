#include "pipeline/encode/overviews.h"

#include <utility>

#include "io/tag/members.h"
#include "pipeline/job/source_survey.h"
#include "pipeline/memory/plan.h"
#include "pipeline/overview/header.h"
#include "pipeline/overview/means_source.h"

namespace tagrid {

void write_overviews(const TagHeader& file, const std::vector<int>& factors, const Statistics& total,
                     SumsFile sums, const Resources& resources, const std::string& output,
                     const MemberOut& out, const std::function<void()>& before_reading) {
  Watch watch = watch_for({}, 0);
  watch.before_reading = before_reading;
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
        .encode(BrickRows::all(p.bricks()), writer, watch);
    writer.finish();
    out(overview_kind, static_cast<std::uint32_t>(factor), encoded.size(),
        [&](const PassBytes& pass) { encoded.read_back([&](std::span<std::byte> bytes) { pass(bytes); }); });
  }
}

OverviewsOfStream::OverviewsOfStream(TagHeader header, std::vector<int> factors, const Resources& resources,
                                     std::string output)
    : header_(std::move(header)),
      factors_(std::move(factors)),
      resources_(resources),
      output_(std::move(output)) {
  const CodingParameters& p = header_.parameters;
  if (!factors_.empty()) sums_.emplace(layout_of_sums(p.dims, p.type, block_edge), resources_.spool, output_);
}

void OverviewsOfStream::sum_blocks_of(RowEncoder& encoder) {
  if (!sums_) return;
  encoder.sum_blocks(
      [this](std::int64_t z, std::int64_t y, std::span<const std::byte> rows) { sums_->write(z, y, rows); });
}

void OverviewsOfStream::write(TagWriter& writer, const std::function<void()>& before_reading) {
  if (!sums_) return;
  write_overviews(
      header_, factors_, writer.index().total, std::move(*sums_), resources_, output_,
      [&](std::uint32_t kind, std::uint32_t factor, std::uint64_t length, const auto& content) {
        writer.write_member(kind, factor, length, content);
      },
      before_reading);
  sums_.reset();
}

}  // namespace tagrid
