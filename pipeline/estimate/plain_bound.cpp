#include "pipeline/estimate/plain_bound.h"

#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <vector>

#include "io/files/errors.h"
#include "pipeline/estimate/bricks_of_source.h"
#include "pipeline/estimate/noise.h"

namespace tagrid {
namespace {

// The PSNR of encodings of a volume.
class Psnr {
 public:
  Psnr(const EncodeOptions& options, VolumeSource& source) : source_(source) {
    const auto [low, high] = range_of_data(source);
    peak_ = high - low;
    EncodeOptions voxels = options;
    voxels.error_rule.reset();
    voxels.mesh_error.reset();
    voxels.grid = GridOrigin::derived;
    parameters_ = parameters_but_scale(voxels, source.info());
  }

  double peak() const { return peak_; }
  /// In dB; infinite if nothing is lost. `sampled`: of a part of the rows of bricks, evenly over the volume.
  double of(double max_error, bool sampled) {
    constexpr std::int64_t most_sampled = std::int64_t{1} << 24;
    parameters_.max_error = max_error;
    const BrickGrid bricks = parameters_.bricks();
    const std::int64_t rows = bricks.bricks(1) * bricks.bricks(2),
                       per_row = std::max<std::int64_t>(parameters_.domain().volume().count() / rows, 1),
                       wanted = sampled ? std::clamp<std::int64_t>(most_sampled / per_row, 1, rows) : rows;
    double squares = 0, finite = 0;
    for (std::int64_t i = 0; i < wanted; ++i) {
      std::vector<Statistics> of_brick(static_cast<std::size_t>(bricks.bricks(0)));
      for_each_brick_of_row(source_, bricks, (2 * i + 1) * rows / (2 * wanted),
                            [&](std::int64_t id, const BrickSamples& samples) {
                              const Index3 position = bricks.position(id);
                              BrickCode code;
                              encode_brick(samples, {}, parameters_, position, code);
                              of_brick[static_cast<std::size_t>(position.x)] = code.statistics;
                            });
      // In the order of bricks: sums of floats depend on it.
      for (const Statistics& s : of_brick) {
        squares +=
            is_float_type(parameters_.type) ? s.sum_squared_real : static_cast<double>(s.sum_squared_error);
        finite += static_cast<double>(s.finite);
      }
    }
    return squares > 0 ? 10 * std::log10(peak_ * peak_ * finite / squares) : INFINITY;
  }

 private:
  VolumeSource& source_;
  CodingParameters parameters_;
  double peak_ = 0;
};

// The largest whole bound that reaches the PSNR.
double loosest_whole(Psnr& psnr, double wanted) {
  const auto reaches = [&](double bound, bool sampled) { return psnr.of(bound, sampled) >= wanted; };
  double low = 0, high = 1;
  while (high < psnr.peak() && reaches(high, true)) low = high, high *= 2;
  while (high - low > 1) {
    const double middle = std::floor((low + high) / 2);
    (reaches(middle, true) ? low : high) = middle;
  }
  // The sample may be off by a little.
  while (low > 0 && !reaches(low, false)) --low;
  while (low < psnr.peak() && reaches(low + 1, false)) ++low;
  return low;
}

// The largest bound that reaches the PSNR, or a little less.
double loosest_real(Psnr& psnr, double wanted) {
  constexpr double precision = 1.005;
  // Errors are spread evenly at most, so that the bound is sqrt(3) times their root mean square.
  double low = std::sqrt(3.0) * psnr.peak() * std::pow(10, -wanted / 20) / 1.01;
  double high = low;
  while (high < psnr.peak() && psnr.of(high, true) >= wanted) low = high, high *= 2;
  while (high > precision * low) {
    const double middle = std::sqrt(low * high);
    (psnr.of(middle, true) >= wanted ? low : high) = middle;
  }
  while (low > 0 && psnr.of(low, false) < wanted) low /= precision;
  return low;
}

[[noreturn]] void refuse(const VolumeSource& source, const Setting& setting, const char* reads) {
  throw UsageError(Sentence{"{}: {} {}, which is not possible here; give {} a number",
                            {source.name(), setting, std::string(reads), setting::max_error}});
}

}  // namespace

PlainBound with_plain_bound(const EncodeOptions& options, VolumeSource& source, int threads) {
  PlainBound plain = {options, ""};
  if (!options.error_rule) return plain;
  const auto [kind, value] = *options.error_rule;
  const bool whole = !is_float_type(source.info().type);
  double bound = 0;
  oneapi::tbb::task_arena arena(std::max(threads, 1));
  arena.execute([&] {
    switch (kind) {
      case ErrorRule::Kind::noise: {
        if (!source.traits().any_rows)
          refuse(source, setting::max_error, "noise: reads parts of the volume first");
        const double noise = noise_of(source);
        bound = whole ? std::floor(value * noise) : value * noise;
        plain.reason =
            fmt::format("the noise is {:.4g} (standard deviation), so the largest error is {}", noise, bound);
        break;
      }
      case ErrorRule::Kind::relative: {
        if (!source.traits().again) refuse(source, setting::relative_error, "reads the volume twice");
        const auto [low, high] = range_of_data(source);
        bound = whole ? std::floor(value * (high - low)) : value * (high - low);
        plain.reason =
            fmt::format("the samples lie between {} and {}, so the largest error is {}", low, high, bound);
        break;
      }
      case ErrorRule::Kind::psnr: {
        if (!source.traits().any_rows) refuse(source, setting::psnr, "reads the volume several times");
        Psnr psnr(options, source);
        bound = whole ? loosest_whole(psnr, value) : loosest_real(psnr, value);
        source.rewind();
        plain.reason = fmt::format("{} dB are reached with a largest error of {}", value, bound);
        break;
      }
    }
  });
  plain.options.error_rule.reset();
  plain.options.max_error = bound;
  return plain;
}

}  // namespace tagrid
