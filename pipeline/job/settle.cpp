#include "pipeline/job/settle.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "io/errors/errors.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/job/source_survey.h"
#include "pipeline/threads/threads.h"
#include "stages/brick/codec.h"
#include "stages/sample/statistics.h"

namespace tagrid {
namespace {

struct FoundBound {
  double max_error = 0;    ///< of samples; an integer if they are integers
  std::string reason;      ///< how it follows from the samples
  std::string doubt = {};  ///< why it may not be what is wanted; "" if nothing says that
  std::uint32_t step = 0;  ///< of a transform; 0: none
};

double width(const std::optional<std::pair<double, double>>& range) {
  return range ? range->second - range->first : 0;
}

struct Tried {
  double psnr = 0;  ///< in dB; infinite if nothing is lost
  double rmse = 0, max_error = 0;
  double bits = 0;  ///< of a sample, without the grid
};

// Encodings of a volume, or of a part of its rows of bricks that is spread over it. Bricks have the usual size,
// so that a part has many rows, unless all of the volume is transformed.
class Trials {
 public:
  Trials(const ResolvedOptions& options, VolumeSource& source, double peak, const Progress& progress)
      : source_(source), parameters_(options.parameters), peak_(peak), progress_(progress) {
    // Of the voxels alone: a grid changes no decoded sample.
    parameters_.mesh_error = -1;
    parameters_.grid = GridOrigin::derived;
    usual_ = parameters_;
    if (!options.options.brick_edge) usual_.brick_edge = usual_brick_edge(usual_.cube_size);
  }

  /// `step`: of a transform; 0: none.
  Tried of(double max_error, std::uint32_t step, bool sampled) {
    CodingParameters parameters = sampled || step == 0 ? usual_ : parameters_;
    parameters.max_error = max_error;
    parameters.transform_step = step;
    const BrickGrid bricks = parameters.bricks();
    const std::int64_t rows = bricks.bricks(1) * bricks.bricks(2), all_rows = rows * source_.info().volumes;
    const std::int64_t per_row = std::max<std::int64_t>(parameters.domain().volume().count() / rows, 1);
    constexpr std::int64_t most_sampled = std::int64_t{1} << 24, least_rows = 8;
    const std::int64_t wanted =
        sampled ? std::min(std::max(most_sampled / per_row, least_rows), all_rows) : all_rows;
    const std::uint64_t bytes_per_row = static_cast<std::uint64_t>(per_row) * size_of(parameters.type);
    const Watch watch = watch_for(progress_, static_cast<std::uint64_t>(wanted) * bytes_per_row);
    Statistics all;
    std::atomic<std::uint64_t> bytes = 0;
    for (std::int64_t i = 0; i < wanted; ++i) {
      std::vector<Statistics> of_brick(static_cast<std::size_t>(bricks.bricks(0)));
      const std::int64_t row = spread_row(i, wanted, all_rows);
      const auto volume = one_of_volumes(source_, row / rows);
      for_each_brick_of_row(*volume, bricks, row % rows, [&](std::int64_t id, const BrickSamples& samples) {
        const Index3 position = bricks.position(id);
        BrickCode code;
        encode_brick(samples, {}, parameters, position, code);
        of_brick[static_cast<std::size_t>(position.x)] = code.statistics;
        bytes += code.values.size();
      });
      // In the order of bricks: sums of floats depend on it.
      for (const Statistics& s : of_brick) all.add(s);
      watch.done(bytes_per_row);
    }
    Tried tried{INFINITY, 0, all.max_error,
                8 * static_cast<double>(bytes) / static_cast<double>(all.samples)};
    if (all.finite == 0 || all.max_error == 0) return tried;
    tried.rmse = achieved_of(all).rmse;
    // Squares of very small errors are 0.
    if (tried.rmse == 0) tried.rmse = all.max_error;
    tried.psnr = 20 * std::log10(peak_ / tried.rmse);
    return tried;
  }

 private:
  VolumeSource& source_;
  CodingParameters parameters_, usual_;
  double peak_;
  const Progress& progress_;
};

// Returns the largest number for which `reaches` holds. Searches from `start` in growing steps, then between
// the last two numbers. `least` needs no test; no number exceeds `most`.
std::int64_t last_that_reaches(std::int64_t start, std::int64_t step, std::int64_t least, std::int64_t most,
                               const std::function<bool(std::int64_t)>& reaches) {
  std::int64_t low = std::clamp(start, least, most), high = low;
  if (low == least || reaches(low)) {
    for (;; step *= 2) {
      if (low == most) return most;
      high = step < most - low ? low + step : most;
      if (!reaches(high)) break;
      low = high;
    }
  } else {
    for (;; step *= 2) {
      low = step < high - least ? high - step : least;
      if (low == least || reaches(low)) break;
      high = low;
    }
  }
  while (high - low > 1) {
    const std::int64_t middle = low + (high - low) / 2;
    (reaches(middle) ? low : high) = middle;
  }
  return low;
}

// The bound whose errors have this PSNR if they are spread evenly within it: their root mean square is its part
// 1 / sqrt(3).
double likely_bound(double wanted, double peak) { return std::sqrt(3.0) * peak * std::pow(10, -wanted / 20); }

// The loosest bounds that reach a PSNR: whole numbers for integers, and steps of half a percent for floats.
class Bounds {
 public:
  Bounds(Trials& trials, double wanted, double peak, bool whole)
      : trials_(trials), wanted_(wanted), guess_(likely_bound(wanted, peak)), whole_(whole) {
    if (!(guess_ > 0)) return;
    most_ = whole ? static_cast<std::int64_t>(std::max(peak, 1.0))
                  : std::max<std::int64_t>(
                        static_cast<std::int64_t>(std::log(peak / guess_) / std::log(step)), 0);
  }

  // The bound for a sample of the volume, which is nearly that for all of it.
  double of_sample() {
    if (!(guess_ > 0)) return 0;
    const std::int64_t start = whole_ ? static_cast<std::int64_t>(guess_) : 0;
    if (!nearly_) nearly_ = search(start, whole_ ? std::max<std::int64_t>(start / 2, 1) : 64, true);
    return bound(*nearly_);
  }
  double of_all() {
    if (!(guess_ > 0)) return 0;
    of_sample();
    return bound(search(*nearly_, 1, false));
  }

 private:
  static constexpr double step = 1.005;
  static constexpr std::int64_t tiny = -3700;  // 1e-8 of the guess

  double bound(std::int64_t n) const {
    return whole_ ? static_cast<double>(n) : n == tiny ? 0 : guess_ * std::pow(step, static_cast<double>(n));
  }
  std::int64_t search(std::int64_t from, std::int64_t first_step, bool sampled) {
    return last_that_reaches(from, first_step, whole_ ? 0 : tiny, most_, [&](std::int64_t n) {
      return trials_.of(bound(n), 0, sampled).psnr >= wanted_;
    });
  }

  Trials& trials_;
  double wanted_, guess_;
  bool whole_;
  std::int64_t most_ = 0;
  std::optional<std::int64_t> nearly_;
};

struct FoundStep {
  std::uint32_t step = 0;  ///< 0: none
  Tried tried;
};

// The largest step of a transform with which the PSNR is reached, nearly: the mean squared error is at least 0.995 of
// what is allowed, or the next larger step does not reach it. The error grows with a power of the step of about 5 / 3,
// steadily but not strictly. Searches from `first`; 0: a guess. If some step loses nothing, that is the result: its
// bricks are not transformed.
FoundStep largest_step(Trials& trials, double wanted, double peak, double max_error, std::uint32_t first,
                       bool sampled) {
  constexpr double enough = 0.995;
  constexpr int most_tries = 12;
  const double rmse = peak * std::pow(10, -wanted / 20), allowed = rmse * rmse;
  const auto limited = [](double step) {
    return static_cast<std::uint32_t>(std::clamp(std::round(step), 1.0, double{largest_transform_step}));
  };
  std::uint32_t step = first > 0 ? first : limited(64 * 8 * rmse), too_large = 0;
  FoundStep best;
  for (int i = 0; i < most_tries; ++i) {
    const Tried tried = trials.of(max_error, step, sampled);
    if (tried.max_error == 0) return {step, tried};
    const double part = tried.rmse * tried.rmse / allowed;
    if (part <= 1) {
      if (step > best.step) best = {step, tried};
      if (part >= enough || best.step == largest_transform_step) break;
    } else if (too_large == 0 || step < too_large) {
      too_large = step;
    }
    if (too_large > 0 && best.step + 1 >= too_large) break;
    // A little less than what is allowed, so that the next try is more likely to be the last one. Roots are exact on
    // every machine: the power is 5 / 8.
    const double more = (1 + enough) / 2 / part, root = std::sqrt(more);
    double likely = static_cast<double>(step) * root * std::sqrt(std::sqrt(root));
    // Where the error jumps, powers lead nowhere.
    if (i >= 2 && best.step == 0) likely = std::min(likely, step / 2.0);
    if (i >= 3 && best.step > 0 && too_large > 0)
      likely = std::sqrt(static_cast<double>(best.step) * static_cast<double>(too_large));
    std::uint32_t next = limited(likely);
    if (next <= best.step && best.step > 0) next = best.step + 1;
    if (too_large > 0 && next >= too_large) next = too_large - 1;
    if (next == step || next == 0) break;
    step = next;
  }
  return best;
}

// Of a transform, if it takes fewer bits than the loosest bound: that is found out from a sample.
FoundStep step_if_better(Trials& trials, Bounds& bounds, double wanted, double peak, double max_error) {
  FoundStep found = largest_step(trials, wanted, peak, max_error, 0, true);
  if (found.step == 0 || found.tried.max_error == 0) return {};
  const double bound = std::min(bounds.of_sample(), max_error);
  if (found.tried.bits >= trials.of(bound, 0, true).bits) return {};
  found = largest_step(trials, wanted, peak, max_error, found.step, false);
  return found.tried.max_error > 0 ? found : FoundStep();
}

[[noreturn]] void refuse(const VolumeSource& source, const Setting& setting, const char* reads) {
  throw UsageError(Sentence{
      "{}: {} {}, which is not possible here; give {} a number, or {} for a copy",
      {source.name(), setting, std::string(reads), setting::max_error, Setting{"spool", "a directory"}}});
}

FoundBound by_noise(VolumeSource& source, double times) {
  if (!source.traits().any_rows) refuse(source, setting::max_error, "noise: reads parts of the volume first");
  const Noise noise = noise_of(source);
  return {times * noise.deviation, fmt::format("the noise is {:.4g} (standard deviation)", noise.deviation),
          noise.doubt};
}

FoundBound by_range(VolumeSource& source, double part) {
  if (!source.traits().again) refuse(source, setting::relative_error, "reads the volume twice");
  const auto range = range_of_data(source);
  return {part * width(range),
          range ? fmt::format("the samples lie between {} and {}", range->first, range->second)
                : "no sample is finite"};
}

FoundBound by_psnr(const ResolvedOptions& options, VolumeSource& source, double wanted,
                   const Progress& progress) {
  if (!source.traits().any_rows) refuse(source, setting::psnr, "reads the volume several times");
  const double peak = width(range_of_data(source));
  require(std::isfinite(peak),
          {"{}: {} is undefined for samples whose range is not finite", {source.name(), setting::psnr}});
  Trials trials(options, source, peak, progress);
  const bool whole = !is_float_type(source.info().type);
  Bounds bounds(trials, wanted, peak, whole);
  const std::optional<double>& given = options.options.max_error;
  FoundBound found;
  found.reason = fmt::format("to reach {} dB", wanted);
  // Below a step of samples, a bound is 0.
  if (given && (*given == 0 || (whole && *given < 1))) {
    found.reason = fmt::format("which reaches {} dB", wanted);
  } else {
    FoundStep best;
    // Without a bound, nothing is corrected.
    if (options.parameters.transform_step > 0 && peak > 0)
      best = step_if_better(trials, bounds, wanted, peak, given ? std::floor(*given) : 65535);
    found.step = best.step;
    if (best.step > 0) {
      // What is beyond a bound that was given is corrected, and then within it.
      found.max_error = best.tried.max_error;
    } else {
      found.max_error = bounds.of_all();
      if (given && *given < found.max_error) {
        found.max_error = *given;
        found.reason = fmt::format("with which the PSNR is more than {} dB", wanted);
      }
    }
  }
  source.rewind();
  return found;
}

// The largest error by the rule of the options. Reads the volume and rewinds it: a sample for the noise, all
// of it for its range. For a PSNR, a sample is coded some ten times, and all of it three times or a few more:
// the next larger bound, by one or by half a percent, does not reach it. Throws UsageError if the volume
// cannot be read like that, or if the bound cannot be combined with the other options.
FoundBound bound_of_rule(const ResolvedOptions& options, VolumeSource& source, int threads,
                         const Progress& progress) {
  const auto [kind, value] = options.options.error_rule.value();
  FoundBound found;
  Threads(std::max(threads, 1)).run([&, kind = kind, value = value] {
    found = kind == ErrorRule::Kind::noise      ? by_noise(source, value)
            : kind == ErrorRule::Kind::relative ? by_range(source, value)
                                                : by_psnr(options, source, value, progress);
  });
  found.max_error = std::min(found.max_error, std::numeric_limits<double>::max());
  found.max_error = kept_bound(found.max_error, source.info().type);
  found.reason = found.step > 0 ? fmt::format("a wavelet with a step of {:.4g}, {}; no error is above {}",
                                              found.step / 64.0, found.reason, found.max_error)
                 : kind == ErrorRule::Kind::psnr
                     ? fmt::format("maximum error set to {}, {}", found.max_error, found.reason)
                     : fmt::format("{}, so the maximum error is set to {}", found.reason, found.max_error);
  return found;
}

std::pair<double, double> range_for(VolumeSource& source) {
  auto range = range_of_data(source).value_or(std::pair(0.0, 0.0));
  if (range.first == range.second) ++range.second;  // a constant volume: any scale is good
  return range;
}

EncodeJob job_of(const ResolvedOptions& options, const EncodePlan& plan) {
  return {{options.parameters, options.fields, options.volumes},
          plan,
          options.overviews,
          options.reason_of_bound};
}

void require_known_range(const ResolvedOptions& options) {
  require(!options.range_from_data || options.options.range_from_data,
          {"a pipe of {} samples needs {} lo:hi or {}: its range is not known before it has been read",
           {name_of(options.parameters.type), setting::range, setting::field_scale}});
}

}  // namespace

EncodeJob settle(const ResolvedOptions& options, const EncodePlan& plan, VolumeSource& source,
                 const Progress& searching, const EarlierFindings& earlier) {
  EncodeJob job = job_of(options, plan);
  ResolvedOptions settled = options;
  if (options.options.error_rule) {
    FoundBound found = {earlier.max_error.value_or(0), earlier.reason_of_bound, {}, earlier.transform_step};
    if (!earlier.max_error) found = bound_of_rule(options, source, plan.budget.threads, searching);
    settled = with_bound(options, found.max_error, found.step);
    job.reason_of_bound = found.reason;
    job.doubt_of_bound = found.doubt;
  }
  if (!source.traits().again) require_known_range(options);
  job.header.parameters = settled.parameters;
  if (settled.range_from_data) {
    job.times_read = earlier.range ? 0 : 1;
    job.header.parameters = with_range(settled, earlier.range ? *earlier.range : range_for(source));
  }
  return job;
}

EncodeJob settle(const ResolvedOptions& options, const EncodePlan& plan) {
  require_known_range(options);
  require(!options.options.error_rule && !options.range_from_data,
          {"{} follows from the samples, which cannot be read beforehand",
           {options.range_from_data ? setting::range : setting::max_error}});
  return job_of(options, plan);
}

}  // namespace tagrid
