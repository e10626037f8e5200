#include "pipeline/estimate/sample.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "pipeline/settle/source_survey.h"
#include "stages/survey/survey.h"

namespace tagrid {
namespace {

constexpr std::int64_t most_samples_chosen = std::int64_t{1} << 24;

void look_at_bricks(VolumeSource& source, const BrickGrid& grid, std::span<const double> steps,
                    double most_bytes, BrickSample& sample) {
  const std::int64_t rows = grid.bricks(1) * grid.bricks(2);
  const double bytes = static_cast<double>(source.slice_bytes()) * static_cast<double>(source.info().dims.z),
               part = std::min(1.0, most_bytes / bytes);
  const std::int64_t wanted =
      std::clamp<std::int64_t>(static_cast<std::int64_t>(part * static_cast<double>(rows)), 1, rows);
  std::mutex mutex;
  for (std::int64_t i = 0; i < wanted; ++i)
    for_each_brick_of_row(
        source, grid, spread_row(i, wanted, rows), [&](std::int64_t id, const BrickSamples& brick) {
          with_sample_type(source.info().type, [&](auto type) {
            using T = decltype(type);
            const Samples<T> samples{brick.box, reinterpret_cast<const T*>(brick.bytes.data())};
            SurveyedBrick surveyed{id, roughness(samples, steps)};
            const ValueRange range = value_range(brick.bytes, source.info().type);
            const std::lock_guard lock(mutex);
            sample.bricks.push_back(std::move(surveyed));
            sample.range.add(range);
          });
        });
}

void sort_by_share(std::size_t steps, std::vector<SurveyedBrick>& bricks) {
  // Threads finish in any order, and sums depend on it.
  std::ranges::sort(bricks, {}, &SurveyedBrick::id);
  std::vector<double> all(steps);
  for (const SurveyedBrick& brick : bricks)
    for (std::size_t i = 0; i < steps; ++i) all[i] += brick.roughness[i];
  for (SurveyedBrick& brick : bricks)
    for (std::size_t i = 0; i < steps; ++i) brick.share += all[i] > 0 ? brick.roughness[i] / all[i] : 0;
  std::ranges::stable_sort(bricks, {}, &SurveyedBrick::share);
}

// In the order of shares, one brick after every so much of the sum of shares.
void choose(std::size_t wanted, BrickSample& sample) {
  const std::size_t all = sample.bricks.size();
  double total = 0, sum = 0;
  for (const SurveyedBrick& brick : sample.bricks) total += brick.share;
  for (std::size_t i = 0; i < all; ++i) {
    // A part of the weight is the same for all, so that bricks without roughness are not forgotten.
    const double even = 1 / static_cast<double>(all),
                 weight = total > 0 ? 0.1 * even + 0.9 * sample.bricks[i].share / total : even;
    const double before = sum * static_cast<double>(wanted),
                 after = (sum += weight) * static_cast<double>(wanted);
    if (wanted >= all || std::floor(before + 0.5) < std::floor(after + 0.5)) sample.chosen.push_back(i);
  }
  if (sample.chosen.empty()) sample.chosen.push_back(all / 2);
}

}  // namespace

std::int64_t most_chosen(const BrickGrid& grid) {
  constexpr std::int64_t most_bricks = 4096;
  const std::int64_t samples = grid.domain.volume().count(), bricks = grid.count();
  const std::int64_t enough = samples <= most_samples_chosen
                                  ? bricks
                                  : std::max<std::int64_t>(most_samples_chosen / (samples / bricks), 1);
  return std::min({enough, bricks, most_bricks});
}

BrickSample sample_bricks(VolumeSource& source, const BrickGrid& grid, std::span<const double> steps,
                          const SampleSize& size) {
  BrickSample sample;
  look_at_bricks(source, grid, steps, size.bytes, sample);
  sort_by_share(steps.size(), sample.bricks);
  choose(static_cast<std::size_t>(size.bricks), sample);
  return sample;
}

}  // namespace tagrid
