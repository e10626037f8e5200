#include "pipeline/settle/search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "io/errors/errors.h"
#include "io/tag/header.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/overview/block_means.h"
#include "pipeline/overview/header.h"
#include "pipeline/settle/source_survey.h"
#include "pipeline/settle/trials.h"
#include "stages/sample/statistics.h"

namespace tagrid {
namespace {

constexpr std::int64_t sampled_voxels = std::int64_t{1} << 24;

// Returns the largest number for which `reaches` holds. Searches from `start` in growing steps, then between
// the last two numbers. `least` needs no test; no number exceeds `most`.
template <class Reaches>
std::int64_t last_that_reaches(std::int64_t start, std::int64_t step, std::int64_t least, std::int64_t most,
                               Reaches reaches) {
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

// Searches for the loosest bounds: among whole numbers for integers; above 200, and for floats, in steps of half a
// percent.
class Bounds {
 public:
  /// `guess`: not much more than the bound. `reaches` holds for all bounds up to the one that is searched or, if
  /// `beyond`, up to the one before it. Nothing is searched if the guess is not above 0: then it is 0.
  Bounds(Trials& trials, double guess, double peak, bool whole, bool beyond,
         std::function<bool(const Tried&)> reaches)
      : trials_(trials), guess_(guess), whole_(whole), beyond_(beyond), reaches_(std::move(reaches)) {
    if (guess_ > 0) most_ = std::max<std::int64_t>(number_of(whole ? std::max(peak, 1.0) : peak), 0);
  }

  // The bound for a sample of the volume, which is nearly that for all of it.
  double of_sample() {
    if (!(guess_ > 0)) return 0;
    const std::int64_t start = nearly_.value_or(number_of(guess_));
    nearly_ = search(start, nearly_ ? 1 : std::clamp<std::int64_t>(start / 2, 1, 64), true);
    return bound(*nearly_ + beyond_);
  }
  double of_all() {
    if (!(guess_ > 0)) return 0;
    of_sample();
    return bound(search(*nearly_, 1, false) + beyond_);
  }

 private:
  static constexpr double step = 1.005;
  // Of floats, the guess has this number, and the first one, which is 0, is 1e-8 of it.
  static constexpr std::int64_t of_guess = 3700;
  static constexpr std::int64_t finest = 200;

  // The same on every machine, as std::pow() is not.
  static double power_of_step(std::int64_t n) {
    double power = 1, factor = n < 0 ? 1 / step : step;
    for (std::int64_t left = std::abs(n); left > 0; left /= 2, factor *= factor)
      if (left % 2 != 0) power *= factor;
    return power;
  }
  // With 24 digits: the last ones of the guess depend on the machine, and the bound is stored.
  static double rounded(double number) {
    int exponent;
    const double mantissa = std::frexp(number, &exponent);
    return std::ldexp(std::round(std::ldexp(mantissa, 24)), exponent - 24);
  }
  double bound(std::int64_t n) const {
    if (!whole_) return n == 0 ? 0 : rounded(guess_ * power_of_step(n - of_guess));
    return n <= finest ? static_cast<double>(n) : std::floor(finest * power_of_step(n - finest));
  }
  // Of the bound that is at least this one, nearly.
  std::int64_t number_of(double bound) const {
    const auto steps = [](double ratio) {
      return static_cast<std::int64_t>(std::log(ratio) / std::log(step));
    };
    if (!whole_) return of_guess + steps(bound / guess_);
    return bound <= finest ? static_cast<std::int64_t>(bound) : finest + steps(bound / finest);
  }
  std::int64_t search(std::int64_t from, std::int64_t first_step, bool sampled) {
    return last_that_reaches(from, first_step, 0 - beyond_, most_ - beyond_,
                             [&](std::int64_t n) { return reaches_(trials_.of(bound(n), 0, sampled)); });
  }

  Trials& trials_;
  double guess_;
  bool whole_, beyond_;
  std::function<bool(const Tried&)> reaches_;
  std::int64_t most_ = 0;
  std::optional<std::int64_t> nearly_;
};

// What a step has to reach.
struct Goal {
  std::function<double(const Tried&)> part;  ///< of what is allowed; at most 1, and as near to it as possible
  bool grows_with_step;                      ///< so that the largest step is best, and otherwise the smallest
  double enough;                             ///< the part that ends the search
  std::function<double(double)> factor;      ///< of the step that likely changes the part by this factor
};

struct FoundStep {
  double step = 0;  ///< 0: none
  Tried tried;

  /// True if there is a step with which bricks are transformed.
  bool transforms() const { return step > 0 && tried.max_error > 0; }
};

// The step of a transform that is best for a goal, nearly. What it reaches changes steadily with the step, but not
// strictly. Searches from `first`. If some step loses nothing and reaches the goal, that is the result: its bricks are
// not transformed.
FoundStep best_step(Trials& trials, SampleType type, const Goal& goal, double max_error, double first,
                    bool sampled) {
  constexpr int most_tries = 12, most_guesses = 4;
  double step = kept_step(first, type), missed = 0;
  FoundStep best;
  for (int i = 0; i < most_tries; ++i) {
    const Tried& tried = trials.of(max_error, step, sampled);
    const double part = goal.part(tried);
    if (part <= 1) {
      best = {step, tried};
      if (tried.max_error == 0 || part >= goal.enough) break;
    } else {
      missed = step;
    }
    // A little less than what is allowed, so that the next try is more likely to be the last one.
    double next = step * goal.factor((1 + goal.enough) / 2 / part);
    // Where the part jumps, factors lead nowhere.
    if (i >= 2 && best.step == 0)
      next = goal.grows_with_step ? std::min(next, step / 2) : std::max(next, step * 2);
    if (best.step > 0 && missed > 0) {
      const auto [low, high] = std::minmax(best.step, missed);
      if (i >= most_guesses || !(next > low && next < high)) next = std::sqrt(low * high);
      // If the nearest step is one of both ends, there may be one between them after all.
      if (kept_step(next, type) <= low && !is_float_type(type)) next = low + least_transform_step;
      if (kept_step(next, type) <= low || kept_step(next, type) >= high) break;
    }
    next = kept_step(next, type);
    if (next == step) break;
    step = next;
  }
  return best;
}

// Fits a filter at a step, and keeps it if it pays.
void try_filter(Trials& trials, double max_error, const FoundStep& at, std::int64_t samples) {
  trials.fit_filter(max_error, at.step);
  const double part = trials.of(max_error, at.step, true).rmse / at.tried.rmse,
               bytes = at.tried.bits / 8 * static_cast<double>(samples);
  // At low rates, a file is smaller by about the part of the squared error that is gone.
  if (!((1 - part * part) * bytes > 4 * filter_weights)) trials.set_filter({});
}

// Without a bound, nothing is corrected: numbers that are transformed have 16 bits.
double bound_of_trials(const std::optional<double>& given, SampleType type) {
  return given ? kept_bound(*given, type) : is_float_type(type) ? std::numeric_limits<double>::max() : 65535;
}

// The bound that a file with a transform has: the largest error that was found. For wide types, it is so large that it
// changes no decoded sample, as numbers of floats are rounded, and other bricks have half a step as their bound.
double bound_of_step(const FoundStep& found, const std::optional<double>& given, SampleType type) {
  double bound = found.tried.max_error;
  if (is_wide_type(type)) bound = std::max(bound, kept_bound(found.step / 2, type));
  if (is_float_type(type)) bound += found.step / 8;
  return given ? std::min(bound, kept_bound(*given, type)) : bound;
}

// What a search by trials needs to know of a volume.
struct Subject {
  const ResolvedOptions& options;
  const EncodePlan& plan;
  VolumeSource& source;
  Statistics range;  ///< low, high and finite alone
  double peak;
  Trials trials;
  double times_read_besides = 1;  ///< for the range

  double times_read() const { return trials.times_read() + times_read_besides; }

  Subject(const ResolvedOptions& given, const EncodePlan& planned, VolumeSource& volume,
          const Setting& setting, const Progress& progress)
      : options(given),
        plan(planned),
        source(volume),
        range(statistics_of(range_of_data(volume))),
        peak(range.finite > 0 ? range.high - range.low : 0),
        trials(volume, given.parameters, plan, given.usual_edge(), peak, sampled_voxels, progress) {
    // Squares of errors would be infinite.
    require(peak < 0x1p500,
            {"{}: {} cannot be computed for samples whose range is so large", volume.name(), setting});
  }

  SampleType type() const { return source.info().type; }
  std::int64_t samples() const {
    return options.parameters.domain().volume().count() * source.info().volumes;
  }
  bool whole() const { return !is_float_type(type()); }
  bool may_be_transformed() const {
    // Far from the ends of what steps of floats can be.
    return options.parameters.transform_step > 0 && peak > 0x1p-60 && peak < 0x1p90;
  }

 private:
  static Statistics statistics_of(const std::optional<std::pair<double, double>>& range) {
    Statistics statistics;
    if (!range) return statistics;
    statistics.low = range->first;
    statistics.high = range->second;
    statistics.finite = 1;
    return statistics;
  }
};

// Bits a sample that a file takes besides the blocks of its bricks.
double bits_besides(Subject& subject, double max_error, double step, const Progress& progress) {
  constexpr double bytes_of_index_entry = 12;
  constexpr std::int64_t most_means = sampled_voxels / 64;
  const ResolvedOptions options =
      with_bound(subject.options, max_error, step, step > 0 ? subject.trials.filter() : FilterWeights{});
  const TagHeader header{options.parameters, options.metadata};
  const auto volume = one_of_volumes(subject.source, 0);
  const double around = bytes_besides_bricks(header);
  double bytes = around + bytes_of_index_entry * static_cast<double>(options.parameters.bricks().count());
  if (!options.overviews.empty()) {
    BlockMeans means(*volume);
    const CodingParameters p = overview_header(header, block_edge, subject.range).parameters;
    Trials trials(means, p, subject.plan, p.brick_edge, subject.peak, most_means, progress);
    const double finest =
        trials.of(p.max_error, step, true).bits / 8 * static_cast<double>(p.domain().volume().count());
    subject.times_read_besides += trials.times_read();
    for (const int factor : options.overviews) bytes += around + share_of_level(factor) * finest;
  }
  return 8 * bytes / static_cast<double>(options.parameters.domain().volume().count());
}

// Exact on every machine, as roots are: a power of 5 / 8.
double power_of_error(double part) {
  const double root = std::sqrt(part);
  return root * std::sqrt(std::sqrt(root));
}

FoundBound bound_of_psnr(Subject& subject, double psnr, bool sampled) {
  Trials& trials = subject.trials;
  const double rmse = subject.peak * std::pow(10, -psnr / 20);
  const std::optional<double>& given = subject.options.options.max_error;
  FoundBound found;
  found.reason = fmt::format("which reaches {} dB", psnr);
  // Below a step of samples, a bound is 0. No type has so many digits.
  const bool exact = psnr > 2000 && subject.peak > 0;
  if (exact || (given && kept_bound(*given, subject.type()) == 0)) return found;
  found.reason = fmt::format("to reach {} dB", psnr);
  const double max_error = bound_of_trials(given, subject.type());
  // If errors are spread evenly within a bound, their root mean square is its part 1 / sqrt(3).
  Bounds bounds(trials, std::sqrt(3.0) * rmse, subject.peak, subject.whole(), false,
                [psnr](const Tried& tried) { return tried.psnr >= psnr; });
  if (subject.may_be_transformed()) {
    const Goal goal = {[rmse](const Tried& tried) { return tried.rmse / rmse * (tried.rmse / rmse); }, true,
                       0.995, power_of_error};
    FoundStep best = best_step(trials, subject.type(), goal, max_error, 8 * rmse, true);
    if (best.transforms() &&
        best.tried.bits < trials.of(std::min(bounds.of_sample(), max_error), 0, true).bits) {
      try_filter(trials, max_error, best, subject.samples());
      best = best_step(trials, subject.type(), goal, max_error, best.step, sampled);
      if (best.transforms()) {
        found.max_error = bound_of_step(best, given, subject.type());
        found.step = best.step;
        found.filter = trials.filter();
        return found;
      }
    }
  }
  found.max_error = sampled ? bounds.of_sample() : bounds.of_all();
  if (given && *given < found.max_error) {
    found.max_error = *given;
    found.reason = fmt::format("with which the PSNR is more than {} dB", psnr);
  }
  return found;
}

FoundBound bound_of_size(Subject& subject, double bits, bool sampled, const Progress& progress) {
  const ErrorRule& rule = subject.options.options.error_rule.value();
  const Setting& setting = setting_of(rule.kind);
  Trials& trials = subject.trials;
  const SampleType type = subject.type();
  const double max_error = bound_of_trials({}, type);
  double besides = 0;
  const auto part = [&](const Tried& tried) { return (tried.bits + besides) / bits; };
  // At low rates, twice the step takes half of the bits; above, it takes up to a bit of a sample less.
  const auto factor = [bits](double more) {
    return (bits > 1 ? std::sqrt(1 / more) : 1) * (bits > 2 ? std::sqrt(1 / more) : 1) / more;
  };
  const Goal goal = {part, false, 0.985, factor};
  // A PSNR of 40 dB and 8 dB a bit are a guess to begin with. No type has more than 64 bits.
  const double rmse = subject.peak * std::pow(10, -(40 + 8 * std::min(bits, 64.0)) / 20);
  Bounds bounds(trials, std::sqrt(3.0) * rmse, subject.peak, subject.whole(), true,
                [&](const Tried& tried) { return part(tried) > 1; });
  FoundStep best;
  double first = 8 * rmse;
  FoundBound found;
  const auto search = [&] {
    best = {};
    found.max_error = bounds.of_sample();
    if (!subject.may_be_transformed() || found.max_error == 0) return;
    best = best_step(trials, type, goal, max_error, first, true);
    const bool better = best.transforms() && best.tried.psnr >= trials.of(found.max_error, 0, true).psnr;
    if (!better) best = {};
    first = best.step > 0 ? best.step : first;
  };
  search();
  if (best.transforms()) try_filter(trials, max_error, best, subject.samples());
  besides = best.step > 0 ? bits_besides(subject, best.tried.max_error, best.step, progress)
                          : bits_besides(subject, found.max_error, 0, progress);
  search();
  if (best.step > 0) best = best_step(trials, type, goal, max_error, best.step, sampled);
  found.reason = rule.kind == ErrorRule::Kind::ratio ? fmt::format("for a ratio of {}", rule.value)
                                                     : fmt::format("for {} bits per voxel", rule.value);
  if (best.transforms()) {
    found.max_error = bound_of_step(best, {}, type);
    found.step = best.step;
    found.filter = trials.filter();
    return found;
  }
  found.max_error = sampled ? bounds.of_sample() : bounds.of_all();
  const double least = trials.of(found.max_error, 0, sampled).bits + besides;
  const double bits_of_sample = 8.0 * static_cast<double>(size_of(type));
  require(least <= bits,
          {"{}: {} {} cannot be reached; the smallest file has about {} bits per voxel, a ratio of {}",
           subject.source.name(), setting, rule.value, fmt::format("{:.3g}", least),
           fmt::format("{:.4g}", bits_of_sample / least)});
  return found;
}

}  // namespace

bool is_sampled(const Index3& dims) { return Box::of_size(dims).count() > sampled_voxels; }

FoundBound bound_by_trials(const ResolvedOptions& options, const EncodePlan& plan, VolumeSource& source,
                           bool sampled, const Progress& progress) {
  const auto [kind, value] = options.options.error_rule.value();
  const double bits_of_sample = 8.0 * static_cast<double>(size_of(source.info().type));
  const double bits = kind == ErrorRule::Kind::ratio ? bits_of_sample / value : value;
  source.rewind();
  Subject subject(options, plan, source, setting_of(kind), progress);
  FoundBound found = kind == ErrorRule::Kind::psnr ? bound_of_psnr(subject, value, sampled)
                                                   : bound_of_size(subject, bits, sampled, progress);
  if (sampled && found.max_error > 0) {
    const double tried_error =
        found.step > 0 ? bound_of_trials(options.options.max_error, subject.type()) : found.max_error;
    const Tried& tried = subject.trials.of(tried_error, found.step, true);
    found.psnr = tried.psnr;
    found.rmse = tried.rmse;
  }
  found.times_read = subject.times_read();
  source.rewind();
  return found;
}

}  // namespace tagrid
