#include "pipeline/estimate/estimate.h"

#include <oneapi/tbb/parallel_for.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "io/files/spool_file.h"
#include "io/formats/table/open_volume.h"
#include "io/samples/file_samples.h"
#include "io/system/this_process.h"
#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/members.h"
#include "io/tag/pages.h"
#include "pipeline/estimate/sample.h"
#include "pipeline/grid/schedule.h"
#include "pipeline/memory/plan.h"
#include "pipeline/overview/block_means.h"
#include "pipeline/overview/header.h"
#include "pipeline/settle/search.h"
#include "pipeline/settle/settle.h"
#include "pipeline/settle/source_survey.h"
#include "pipeline/threads/threads.h"
#include "stages/brick/codec.h"
#include "stages/criterion/marking.h"
#include "stages/criterion/subdivide.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

// Samples of the volume that are read for each mean.
constexpr double samples_per_block = block_edge * block_edge * block_edge;
// Bricks of an overview that are encoded.
constexpr std::int64_t most_bricks_of_overview = 128;
// How often `encode` codes all of a large volume to find a bound, at least.
constexpr double trials_of_all = 3;

// A brick that was encoded with one bound.
struct Encoded {
  std::size_t activity = 0, values = 0;  // bytes
  Statistics statistics;
  double encoding = 0, decoding = 0;  // seconds
};

// The volume, its bounds, and what all threads share.
class Estimator {
 public:
  Estimator(VolumeSource& source, std::vector<CodingParameters> parameters, Progress progress, int threads)
      : source_(source),
        of_bounds_(std::move(parameters)),
        progress_(std::move(progress)),
        threads_(threads),
        bricks_(of_bounds_[0].bricks()) {
    for (const CodingParameters& p : of_bounds_) steps_.push_back(step_of(p));
  }

  EstimateResult estimate(const SampleSize& size) {
    sample_ = sample_bricks(source_, bricks_, steps_, size);
    encode();
    EstimateResult result;
    result.parameters = of_bounds_[0];
    result.low = sample_.range.low;
    result.high = sample_.range.high;
    result.bricks = bricks_.count();
    result.encoded = static_cast<std::int64_t>(sample_.chosen.size());
    for (std::size_t bound = 0; bound < of_bounds_.size(); ++bound)
      result.estimates.push_back(estimate_of(bound));
    return result;
  }

 private:
  // A sample of floats that is kept exactly has no step; this one is as small as its mantissa allows.
  static double step_of(const CodingParameters& p) {
    const double step = 2 * std::max(p.max_error, 0.0) + (is_float_type(p.type) ? 0 : 1);
    return step > 0 ? step : std::max((p.range_high - p.range_low) * 0x1p-24, 1e-30);
  }

  void encode() {
    encoded_.assign(of_bounds_.size(), std::vector<Encoded>(sample_.chosen.size()));
    std::mutex reading;
    std::uint64_t done = 0;
    oneapi::tbb::parallel_for(std::size_t{0}, sample_.chosen.size(), [&](std::size_t i) {
      const Index3 position = bricks_.position(sample_.bricks[sample_.chosen[i]].id);
      const CodingParameters& p = of_bounds_[0];
      const Box around = p.counts_points()
                             ? region_of_marks(bricks_.closed_box(position), p.domain()).grown(halo())
                             : samples_to_encode(p, position);
      SliceRange slices;
      {
        const std::lock_guard lock(reading);
        slices = slices_of_box(source_, p.domain().volume(), around);
      }
      encode_brick_at(position, slices, i);
      const std::lock_guard lock(reading);
      if (progress_) progress_(++done, sample_.chosen.size());
    });
  }

  int halo() const {
    int most = 0;
    for (const CodingParameters& p : of_bounds_) most = std::max(most, mark_halo(p));
    return most;
  }

  // The activity of a brick, and the seconds that it takes if marks are shared with the bricks around.
  std::pair<LatticeBits, double> activity_of(Index3 position, const SliceRange& slices,
                                             const CodingParameters& p) const {
    if (!p.counts_points()) return {};
    const Box closed = bricks_.closed_box(position), region = region_of_marks(closed, p.domain());
    const BrickSamples samples = gather(slices, p.domain().volume(), p.type, region.grown(mark_halo(p)));
    const double start = processor_seconds_of_thread();
    const Box marked = p.bounds_interpolation() ? region : intersection(region, p.domain().volume());
    LatticeBits marks(region);
    copy_bits(mark_tile(samples, region, marked, p), marks);
    const double marked_at = processor_seconds_of_thread();
    LatticeBits active = subdivide(std::move(marks), closed, p.domain());
    const double own = static_cast<double>(closed.count()) / static_cast<double>(region.count());
    return {std::move(active), own * (marked_at - start) + (processor_seconds_of_thread() - marked_at)};
  }

  void encode_brick_at(Index3 position, const SliceRange& slices, std::size_t i) {
    std::pair<LatticeBits, double> grid;
    for (std::size_t bound = 0; bound < of_bounds_.size(); ++bound) {
      const CodingParameters& p = of_bounds_[bound];
      // Without a bound of the interpolation, the grid is that of the original for all of them.
      if (bound == 0 || p.bounds_interpolation()) grid = activity_of(position, slices, p);
      const double start = processor_seconds_of_thread();
      const BrickSamples samples =
          gather(slices, p.domain().volume(), p.type, samples_to_encode(p, position));
      BrickCode code;
      encode_brick(samples, grid.first, p, position, code);
      const double encoded_at = processor_seconds_of_thread();
      DecodedBrick decoded;
      if (!decode_brick({code.activity, code.values}, p, {bricks_.id(position), Wanted::samples}, decoded)
               .ok())
        throw std::logic_error("an encoded brick does not decode");
      Encoded& result = encoded_[bound][i];
      result.statistics = code.statistics;
      result.activity = code.activity.size();
      result.values = code.values.size();
      result.encoding = encoded_at - start + grid.second;
      result.decoding = processor_seconds_of_thread() - encoded_at;
    }
  }

  // Header, index and footer. The pages of all bricks are as compressible as one of those that were encoded.
  double bytes_around_bricks(std::size_t bound) const {
    const CodingParameters& p = of_bounds_[bound];
    std::vector<std::size_t> in_order(sample_.chosen.size());
    std::vector<IndexEntry> page;
    TagIndex index;
    PageFacts facts;
    std::iota(in_order.begin(), in_order.end(), std::size_t{0});
    std::ranges::sort(in_order, {}, [&](std::size_t i) { return sample_.bricks[sample_.chosen[i]].id; });
    for (const std::size_t i : in_order) {
      const Encoded& brick = encoded_[bound][i];
      const double finite = std::max(1.0, static_cast<double>(brick.statistics.finite));
      page.push_back({static_cast<std::uint32_t>(brick.activity), static_cast<std::uint32_t>(brick.values),
                      brick.statistics.low, brick.statistics.high, brick.statistics.sum / finite});
      index.total.add(brick.statistics);
      index.activity_bytes += brick.activity;
      index.value_bytes += brick.values;
      facts.brick_bytes += block_frame_size + brick.activity + brick.values;
    }
    take_range(page, facts);
    const auto none = static_cast<double>(bytes_of_page({})), some = static_cast<double>(bytes_of_page(page));
    const PageLayout layout(bricks_.count());
    facts.sizes_bytes = facts.statistics_bytes = static_cast<std::uint32_t>(some) / 2;
    index.pages.resize(static_cast<std::size_t>(std::min(layout.pages(), PageLayout::most_pages)), facts);
    const auto header = static_cast<double>(serialize_header({p, source_.info().metadata}).size()),
               end = static_cast<double>(file_end(p, index, 0, 0, 0).size());
    return header + end + none * static_cast<double>(layout.pages()) +
           (some - none) / static_cast<double>(page.size()) * static_cast<double>(bricks_.count());
  }

  // A brick that was encoded stands for those that are nearest to it in the order. What they take is in
  // proportion to their roughness or, if it has none, to their number; so are other figures to their number.
  Estimate estimate_of(std::size_t bound) const {
    double bytes = 0, squared_error = 0, finite = 0, encoding = 0, decoding = 0;
    const bool real = is_float_type(of_bounds_[bound].type);
    std::size_t begin = 0;
    for (std::size_t i = 0; i < sample_.chosen.size(); ++i) {
      const std::size_t end = i + 1 == sample_.chosen.size()
                                  ? sample_.bricks.size()
                                  : (sample_.chosen[i] + sample_.chosen[i + 1] + 1) / 2;
      double roughness = 0;
      for (std::size_t k = begin; k < end; ++k) roughness += sample_.bricks[k].roughness[bound];
      const double own = sample_.bricks[sample_.chosen[i]].roughness[bound],
                   number = static_cast<double>(end - begin);
      const Encoded& encoded = encoded_[bound][i];
      const Statistics& statistics = encoded.statistics;
      const double taken = static_cast<double>(block_frame_size + encoded.activity + encoded.values);
      bytes += taken * (own > 0 ? std::min(roughness / own, 4 * number) : number);
      squared_error +=
          number * (real ? statistics.sum_squared_real : static_cast<double>(statistics.sum_squared_error));
      finite += number * static_cast<double>(statistics.finite);
      encoding += number * encoded.encoding;
      decoding += number * encoded.decoding;
      begin = end;
    }
    const double whole = static_cast<double>(bricks_.count()) / static_cast<double>(sample_.bricks.size()),
                 threads = threads_;
    Estimate e;
    e.max_error = of_bounds_[bound].max_error;
    e.transform_step = of_bounds_[bound].transform_step;
    e.file_bytes = whole * bytes + bytes_around_bricks(bound);
    e.rmse = finite > 0 ? std::sqrt(squared_error / finite) : 0;
    e.psnr = e.rmse > 0 ? 20 * std::log10((sample_.range.high - sample_.range.low) / e.rmse) : NAN;
    e.encoding_seconds = whole * encoding / threads;
    e.decoding_seconds = whole * decoding / threads;
    return e;
  }

  VolumeSource& source_;
  std::vector<CodingParameters> of_bounds_;
  Progress progress_;
  int threads_;
  BrickGrid bricks_;
  std::vector<double> steps_;
  BrickSample sample_;
  std::vector<std::vector<Encoded>> encoded_;  // [bound][i]: of the brick sample_.chosen[i]
};

// Adds the overviews with these factors to the estimates of files. They are a few per cent of a file, so that
// fewer bricks are encoded than of the volume, and coarser levels follow from the finest one.
void add_overviews(VolumeSource& source, const std::vector<CodingParameters>& of_bounds,
                   const std::vector<int>& factors, int threads, EstimateResult& result) {
  Statistics total;
  total.finite = result.low <= result.high;
  total.low = result.low;
  total.high = result.high;
  std::vector<CodingParameters> of_means;
  for (const CodingParameters& p : of_bounds)
    of_means.push_back(overview_header({p, {}}, block_edge, total).parameters);
  BlockMeans means(source);
  const SampleSize size = {.bytes = SampleSize().bytes / samples_per_block,
                           .bricks = most_bricks_of_overview};
  const EstimateResult finest = Estimator(means, of_means, {}, threads).estimate(size);
  for (std::size_t bound = 0; bound < of_bounds.size(); ++bound)
    for (const int factor : factors) {
      const Estimate& of_finest = finest.estimates[bound];
      const double share = share_of_level(factor);
      // Every level has all lines of the header.
      const double least = bytes_besides_bricks({of_means[bound], means.info().metadata});
      Estimate& e = result.estimates[bound];
      e.file_bytes += least + share * (of_finest.file_bytes - least) + static_cast<double>(member_frame_size);
      e.encoding_seconds += share * of_finest.encoding_seconds;
    }
}

// Lossless, and bounds around the noise, where most of the choice is. With a grid alone, also no bound.
std::vector<std::optional<double>> usual_errors(double noise, const EncodeOptions& options,
                                                const CodingParameters& p) {
  const bool whole = !is_float_type(p.type);
  const double unit = noise > 0 ? noise : whole ? 4 : std::max((p.range_high - p.range_low) / 1000, 1e-30);
  // Bounds that the other options do not allow are left out.
  const double above = options.surface_error.value_or(-1);
  const bool of_mesh = options.mesh_error && !options.surface_error && !options.grid_only;
  const double most = of_mesh ? *options.mesh_error : HUGE_VAL;
  std::vector<std::optional<double>> errors;
  if (options.grid_only) errors.push_back(std::nullopt);
  if (options.grid_only && p.max_level < max_level(p.cube_size)) return errors;
  double last = -1;
  for (const double part : {0.0, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0}) {
    // As `encode` rounds a multiple of the noise; of floats, numbers that are easy to read.
    const double error =
        whole ? kept_bound(part * unit, p.type) : std::stod(fmt::format("{:.1e}", part * unit));
    if (error <= last || error <= above || error > most) continue;
    errors.push_back(last = error);
  }
  if (errors.empty()) errors.push_back(above < 0 ? 0 : 2 * above + 1);
  return errors;
}

// An estimate of one volume: its options, its source that can be read in any order, and its bounds.
class Estimation {
 public:
  explicit Estimation(const EstimateRun& run) : run_(run) {
    require(run.max_errors.size() + run.rules.size() <= most_bounds,
            {"{} bounds are too many to try at once; give at most {}",
             static_cast<std::int64_t>(run.max_errors.size() + run.rules.size()), most_bounds});
    source_ = open_volume(run.input, run.source);
    require(source_->info().volumes == 1,
            {"{}: holds {} volumes; choose one with {}, by its number", source_->name(),
             source_->info().volumes, Setting{"series", "the number of one"}});
    options_ = in_samples(with_any_bound(run.options), source_->facts());
    open_for_any_rows();
    scaled_ = with_range_of(options_, *source_);
    noise_ = noise_of(*source_);
  }

  EstimateResult result() {
    EstimateResult result;
    if (const std::vector<CodingParameters> bounds = asked_bounds(); !bounds.empty())
      result = estimated(bounds);
    std::vector<UsageError> out_of_reach;
    // Each for itself: the size of bricks depends on the result.
    for (const ErrorRule& rule : run_.rules) {
      try {
        EstimateResult of_rule = estimated_by(rule);
        of_rule.estimates.insert(of_rule.estimates.begin(), result.estimates.begin(), result.estimates.end());
        result = std::move(of_rule);
      } catch (const OutOfReach& error) {
        out_of_reach.push_back(error.why);
      }
    }
    if (result.estimates.empty()) throw UsageError(out_of_reach.front());
    result.out_of_reach = std::move(out_of_reach);
    turn_into_values(result);
    result.threads = threads_;
    return result;
  }

 private:
  static constexpr std::int64_t most_bounds = 64, usual_bounds = 8;
  struct OutOfReach {
    UsageError why;
  };

  // Any bound that the other options allow stands for those that will be tried.
  static EncodeOptions with_any_bound(EncodeOptions options) {
    if (options.surface_error)
      options.error_rule = ErrorRule{ErrorRule::Kind::noise, 1};
    else if (!options.grid_only)
      options.max_error = 0;
    return options;
  }

  ResolvedOptions with_rule(const ErrorRule& rule) const {
    EncodeOptions one = run_.options;
    one.error_rule = rule;
    return in_samples(one, source_->facts());
  }

  // Refuses a limit on memory, and rules, before anything is read.
  void open_for_any_rows() {
    const std::size_t asked = run_.max_errors.size() + run_.rules.size();
    const std::int64_t bounds = asked == 0 ? usual_bounds : static_cast<std::int64_t>(asked);
    // With rules, bricks may be larger.
    CodingParameters largest = options_.parameters;
    for (const ErrorRule& rule : run_.rules) largest = with_rule(rule).parameters;
    const std::uint64_t of_source =
        source_->traits().memory + (source_->traits().any_rows ? 0 : source_->slice_bytes());
    const auto memory_with = [&](int threads) {
      return memory_of_estimating(largest, threads, bounds, most_chosen(largest.bricks())) + of_source;
    };
    threads_ = threads_within(run_.resources, "estimating this volume", memory_with);
    const std::uint64_t memory = memory_with(threads_);
    if (needs_copy(source_->traits(), Look::all_rows_often, run_.resources))
      source_ = copied(std::move(source_), run_.resources, memory, run_.before_copy);
    if (source_->traits().any_rows) return;
    const std::int64_t layer = std::min(largest.bricks().length(), largest.dims.z);
    EncodePlan estimating;
    estimating.memory = memory;
    source_ = rows_of_slices(std::move(source_), slices_beside(largest, estimating, run_.resources, layer));
  }

  // All encodings have the same range and scale.
  CodingParameters scaled(CodingParameters p) const {
    p.range_low = scaled_.range_low;
    p.range_high = scaled_.range_high;
    p.field_scale = scaled_.field_scale;
    return p;
  }

  std::vector<CodingParameters> asked_bounds() const {
    std::vector<CodingParameters> bounds;
    for (const double error : run_.max_errors) {
      EncodeOptions one = run_.options;
      one.max_error = error;
      bounds.push_back(scaled(in_samples(one, source_->facts()).parameters));
    }
    if (bounds.empty() && run_.rules.empty())
      for (const auto& error : usual_errors(noise_.deviation, options_.options, scaled_))
        bounds.push_back(scaled(with_bound(options_, error).parameters));
    return bounds;
  }

  EstimateResult estimated(const std::vector<CodingParameters>& bounds) {
    EstimateResult result;
    Threads(threads_).run([&] {
      const SampleSize size = {.bricks = most_chosen(bounds[0].bricks())};
      result = Estimator(*source_, bounds, run_.progress, threads_).estimate(size);
      if (!options_.overviews.empty()) add_overviews(*source_, bounds, options_.overviews, threads_, result);
    });
    return result;
  }

  // Throws OutOfReach if no encoding keeps the rule.
  EstimateResult estimated_by(const ErrorRule& rule) {
    const ResolvedOptions ruled = with_rule(rule);
    const auto start = std::chrono::steady_clock::now();
    const FoundBound bound = [&] {
      try {
        EncodePlan row_by_row;
        row_by_row.budget = {threads_, 0, threads_};
        return bound_by_trials(ruled, row_by_row, *source_, true, {});
      } catch (const UsageError& error) {
        throw OutOfReach{error};
      }
    }();
    const std::chrono::duration<double> searched = std::chrono::steady_clock::now() - start;
    EstimateResult result =
        estimated({scaled(with_bound(ruled, bound.max_error, bound.step, bound.filter).parameters)});
    Estimate& e = result.estimates.front();
    e.rule = rule;
    // The bricks of the estimate are others, and do not show all of the range.
    if (bound.rmse > 0) {
      e.psnr = bound.psnr;
      e.rmse = bound.rmse;
    }
    e.search_seconds =
        searched.count() + (is_sampled(source_->info().dims) ? trials_of_all * e.encoding_seconds : 0);
    return result;
  }

  // Bounds and errors become those of values, as they were given.
  void turn_into_values(EstimateResult& result) const {
    const Rescale& rescale = source_->facts().rescale;
    const double slope = std::abs(rescale.slope);
    result.noise = noise_.deviation * slope;
    result.doubt_of_noise = noise_.doubt;
    std::tie(result.low, result.high) = std::minmax(
        {result.low * rescale.slope + rescale.intercept, result.high * rescale.slope + rescale.intercept});
    for (Estimate& estimate : result.estimates) {
      if (estimate.max_error > 0) estimate.max_error *= slope;
      estimate.asked_error = estimate.max_error;
      estimate.rmse *= slope;
    }
    for (std::size_t i = 0; i < run_.max_errors.size(); ++i)
      result.estimates[i].asked_error = run_.max_errors[i];
  }

  const EstimateRun& run_;
  std::unique_ptr<VolumeSource> source_;
  ResolvedOptions options_;  // without a range that follows from samples
  CodingParameters scaled_;  // with it
  Noise noise_;
  int threads_ = 1;
};

}  // namespace

// Each thread encodes and decodes bricks by themselves, with all that is around them.
std::uint64_t memory_of_estimating(const CodingParameters& p, std::int64_t threads, std::int64_t bounds,
                                   std::int64_t chosen) {
  constexpr Index3 largest{0, 0, 0};
  constexpr double bytes_of_survey = 64;     // how rough a brick is, without a number for each bound
  constexpr double bytes_of_estimate = 400;  // what the encoding of a brick with one bound gave
  constexpr double growing = 3;              // a list grows by copying
  const BrickGrid bricks = p.bricks();
  const auto sample = static_cast<double>(size_of(p.type));
  const std::int64_t region = bricks.length() + 2 * p.cube_size + 1;
  const auto rows = static_cast<double>(region + 2 * mark_halo(p));
  const double slices = static_cast<double>(p.dims.x) * std::min(rows, static_cast<double>(p.dims.y)) *
                        std::min(rows, static_cast<double>(p.dims.z)) * sample;
  const double marking = rows * rows * rows * sample +
                         static_cast<double>(working_bytes_of_marking(p, {region, region, region}));
  const double owned = static_cast<double>(bricks.owned_box(largest).count()) * sample,
               bits = memory_of_activity(p);
  const double encoding = static_cast<double>(samples_to_encode(p, largest).count()) * sample + bits +
                          static_cast<double>(working_bytes_of_encoding(p, largest));
  const double coding =
      2 * owned + static_cast<double>(most_bytes_of_code(p, largest)) +
      std::max(encoding, static_cast<double>(working_bytes_of_decoding(p, largest, Wanted::samples)));
  const double work = std::max({marking, memory_of_subdividing(p), coding}) + bits;
  const double looked_at = count_of_bricks(p) * growing * (bytes_of_survey + 8 * static_cast<double>(bounds)),
               encoded = static_cast<double>(chosen) * static_cast<double>(bounds) * bytes_of_estimate;
  return memory_of_process(slices + static_cast<double>(threads) * (slices + work) + looked_at + encoded);
}

EstimateResult estimate_encoding(const EstimateRun& run) { return Estimation(run).result(); }

}  // namespace tagrid
