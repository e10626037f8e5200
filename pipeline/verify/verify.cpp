#include "pipeline/verify/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "io/files/file_attributes.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "io/tag/file.h"
#include "io/tag/members.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/decode/graph.h"
#include "pipeline/grid/schedule.h"
#include "pipeline/memory/plan.h"
#include "pipeline/overview/block_means.h"
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verifier.h"
#include "stages/brick/codec.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;

// A direction that went through a float32 quaternion (NIfTI) is off by some 1e-6 of its length. Over a
// thousand samples, 1e-5 of a spacing is a hundredth of a sample.
constexpr double of_places = 1e-5;
// A slope has no such detours: float32 keeps it within 6e-8.
constexpr double of_values = 1e-6;

constexpr std::array axis_names = {'x', 'y', 'z'};

std::string text(const Vector& v) { return fmt::format("({}, {}, {})", v[0], v[1], v[2]); }

double length(const Vector& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

bool is_near(const Vector& a, const Vector& b, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i)
    if (!(std::abs(a[i] - b[i]) <= tolerance)) return false;
  return true;
}

/// What turns lengths of `theirs` into those of `ours`; 1 if one has no units. Nothing if that is unknown.
std::optional<double> factor_of_lengths(const Geometry& ours, const Geometry& theirs) {
  const std::array<std::string, 3> none;
  if (ours.units == theirs.units || ours.units == none || theirs.units == none) return 1;
  std::array<std::optional<LengthUnit>, 2> unit;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& units = (i == 0 ? ours : theirs).units;
    if (units[0] == units[1] && units[1] == units[2]) unit[i] = length_unit(units[0]);
  }
  if (!unit[0] || !unit[1]) return std::nullopt;
  return unit[1]->femtometers / unit[0]->femtometers;
}

class GeometryOfBoth {
 public:
  GeometryOfBoth(const Metadata& metadata, const Metadata& original)
      : metadata_{&metadata, &original},
        ours_(metadata.geometry()),
        theirs_(original.geometry()),
        factor_(factor_of_lengths(ours_, theirs_)) {}

  GeometryComparison compare(bool original_has_scale) {
    found_.file_places_samples = says_something(ours_);
    found_.original_places_samples = says_something(theirs_);
    if (factor_) compare_spacing();
    if (const auto signs = factor_ ? signs_of_both() : std::nullopt) {
      if (ours_.has_directions && theirs_.has_directions) compare_directions(*signs);
      if (ours_.has_origin && theirs_.has_origin) compare_origin(*signs);
      compare_numbers("slice_positions", of_places, *signs);
    }
    if (original_has_scale) compare_scale();
    for (const char* key : {"rescale_slope", "rescale_intercept", "slice_slopes", "slice_intercepts"})
      compare_numbers(key, of_values, {1, 1, 1});
    return std::move(found_);
  }

 private:
  void differ(const std::string& what, const std::string& ours, const std::string& theirs) {
    found_.differences.push_back(fmt::format("{} is {}, but {} in the original", what, ours, theirs));
  }

  static bool says_something(const Geometry& geometry) {
    return geometry.has_spacing || geometry.has_origin || geometry.has_directions || !geometry.space.empty();
  }

  /// Without a slope and an intercept, values are the samples: the other side then says something else.
  void compare_scale() {
    struct Pair {
      const char* key;
      double otherwise;
    };
    for (const auto& [key, otherwise] :
         {Pair{"rescale_slope", 1}, {"rescale_intercept", 0}, {"slice_slopes", 1}, {"slice_intercepts", 0}}) {
      const auto ours = numbers_of(*metadata_[0], key), theirs = numbers_of(*metadata_[1], key);
      if (ours.empty() == theirs.empty()) continue;
      const auto says_more = [none = otherwise](double number) { return number != none; };
      if (std::ranges::any_of(ours.empty() ? theirs : ours, says_more))
        found_.differences.push_back(fmt::format("{}: only the {} has one; values differ", key,
                                                 ours.empty() ? "original" : ".tag file"));
    }
  }

  void compare_spacing() {
    bool any = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double a = std::abs(ours_.spacing[axis]), b = std::abs(theirs_.spacing[axis]) * *factor_;
      if (!ours_.has_spacing || !theirs_.has_spacing || std::isnan(a) || std::isnan(b)) continue;
      any = true;
      if (std::abs(a - b) > of_places * std::max(a, b))
        differ(fmt::format("the spacing along {}", axis_names[axis]), fmt::format("{}", a),
               fmt::format("{}", b));
    }
    if (any) found_.compared.emplace_back("spacing");
  }

  /// By which numbers coordinates of the original become ours: signs, with the factor of lengths. Nothing if
  /// it is not known how one space lies in the other: then nothing says that they differ.
  std::optional<Vector> signs_of_both() const {
    const auto ours = signs_of_space(ours_.space), theirs = signs_of_space(theirs_.space);
    if (ours && theirs) {
      Vector signs;
      for (std::size_t i = 0; i < 3; ++i) signs[i] = (*ours)[i] * (*theirs)[i] * *factor_;
      return signs;
    }
    // A space that only one of them names says nothing against the other.
    if (ours_.space.empty() || theirs_.space.empty() || lower_case(ours_.space) == lower_case(theirs_.space))
      return Vector{*factor_, *factor_, *factor_};
    return std::nullopt;
  }

  static Vector times(const Vector& v, const Vector& by) {
    // Adding 0 turns -0 into 0, for messages.
    return {v[0] * by[0] + 0.0, v[1] * by[1] + 0.0, v[2] * by[2] + 0.0};
  }

  void compare_directions(const Vector& by) {
    found_.compared.emplace_back("directions");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vector &a = ours_.directions[axis], b = times(theirs_.directions[axis], by);
      if (std::isnan(a[0]) || std::isnan(b[0])) continue;
      if (!is_near(a, b, of_places * std::max(length(a), length(b))))
        differ(fmt::format("the direction of {}", axis_names[axis]), text(a), text(b));
    }
  }

  void compare_origin(const Vector& by) {
    const Vector &a = ours_.origin, b = times(theirs_.origin, by);
    double scale = std::max(length(a), length(b));
    for (std::size_t axis = 0; axis < 3; ++axis) scale = std::max(scale, std::abs(spacing_or_1(ours_, axis)));
    found_.compared.emplace_back("origin");
    if (!is_near(a, b, of_places * scale)) differ("the origin", text(a), text(b));
  }

  /// Compares numbers with the tolerance of the largest. `factors` multiply those of the original in turn.
  void compare_numbers(std::string_view key, double tolerance, const Vector& factors) {
    const auto a = numbers_of(*metadata_[0], key);
    auto b = numbers_of(*metadata_[1], key);
    for (std::size_t i = 0; i < b.size(); ++i) b[i] *= factors[i % 3];
    if (a.empty() || b.empty()) return;
    found_.compared.emplace_back(key);
    if (a.size() != b.size())
      return differ(std::string(key), fmt::format("a list of {} numbers", a.size()),
                    fmt::format("{} numbers", b.size()));
    double largest = 0;
    for (const auto& numbers : {std::cref(a), std::cref(b)})
      for (const double number : numbers.get())
        if (std::isfinite(number)) largest = std::max(largest, std::abs(number));
    const auto agree = [&](double one, double other) {
      return one == other || (std::isnan(one) && std::isnan(other)) ||
             std::abs(one - other) <= tolerance * largest;
    };
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!agree(a[i], b[i])) {
        const std::string which = a.size() == 1 ? "" : fmt::format(", number {} of {},", i + 1, a.size());
        return differ(std::string(key) + which, fmt::format("{}", a[i]), fmt::format("{}", b[i]));
      }
  }

  static std::vector<double> numbers_of(const Metadata& metadata, std::string_view key) {
    std::vector<double> numbers;
    std::string list = metadata.text_of(key);
    std::ranges::replace(list, ';', ' ');
    for (const std::string_view word : words_of(list)) numbers.push_back(number_of(word).value_or(NAN));
    return numbers;
  }

  std::array<const Metadata*, 2> metadata_;
  const Geometry &ours_, &theirs_;
  std::optional<double> factor_;
  GeometryComparison found_;
};

}  // namespace

GeometryComparison compare_geometry(const Metadata& metadata, const Metadata& of_original,
                                    bool original_has_scale) {
  const Metadata original = with_overridden_spacing(of_original, metadata);
  return GeometryOfBoth(metadata, original).compare(original_has_scale);
}

Statistics count_active_points(TagReader& reader, const Resources& resources, const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const DecodePlan plan = plan_decoding(parameters, resources, DecodeUse::mesh);
  ProgressWatch watch(progress, sample_bytes(parameters.dims, parameters.type).value());
  const BrickRows all = BrickRows::all(parameters.bricks());
  Statistics counted;
  DerivedGrid grid(parameters, all, [&](const SubdividedBrick& brick) {
    count_active(brick.active, parameters, brick.brick, counted);
  });
  RowsTo sink([&](const DecodedRows& decoded) {
    decoded.for_each_slice(grid.samples(), [&](SliceSamples slice) { grid.add_slice(std::move(slice)); });
  });
  decode({parameters, plan.budget, all}, reader, sink, watch);
  return counted;
}

TagSummary summary_with_levels(const std::string& path, const Resources& resources,
                               const Progress& progress) {
  // A pipe can be read only once.
  std::optional<Statistics> of_all;
  if (is_regular_input(path)) {
    TagSummary summary = summary_of(path);
    if (summary.header.parameters.counts_points()) return summary;
    of_all = summary.statistics;
  }
  TagReader reader(path);
  Statistics counted;
  const bool stored = reader.parameters().counts_points();
  if (stored)
    reader.read_to_end();
  else
    counted = count_active_points(reader, resources, progress);
  TagSummary summary = summary_of(reader);
  if (!stored) summary.index.total.active = counted.active;
  if (of_all) summary.statistics = of_all;
  return summary;
}

// Verifies what is nested in a file.

namespace {

// The means of the original's blocks, level by level. They wait in temporary files, which belong to no output.
class OriginalMeans {
 public:
  OriginalMeans(VolumeSource& original, const std::string& spool)
      : dims_(original.info().dims), spool_(spool), sums_(sums_of(original, spool_, "-")) {}

  /// Those of blocks of `factor`, which increases; null if it is not a power of 4, for which there are no sums.
  std::unique_ptr<VolumeSource> means(std::int64_t factor) {
    while (sums_.layout().factor < std::min(factor, largest_factor))
      sums_ = coarser(sums_, dims_, spool_, "-");
    if (sums_.layout().factor != factor) return nullptr;
    return std::make_unique<MeansSource>(sums_, dims_);
  }

 private:
  Index3 dims_;
  std::string spool_;
  SumsFile sums_;
};

void sum_up(const VerifyResult& volume, VerifyResult& all) {
  all.bricks += volume.bricks;
  if (all.active_points && volume.active_points)
    *all.active_points += *volume.active_points;
  else
    all.active_points.reset();
  if (all.max_error && volume.max_error) all.max_error = std::max(*all.max_error, *volume.max_error);
  if (all.mesh_error && volume.mesh_error) all.mesh_error = std::max(*all.mesh_error, *volume.mesh_error);
  all.index.total.add(volume.index.total);
  for (const std::string& difference : volume.geometry.differences)
    if (std::ranges::find(all.geometry.differences, difference) == all.geometry.differences.end())
      all.geometry.differences.push_back(difference);
}

void verify_volume(const TagBricks& file, const Member& member, VolumeSource* original,
                   const Resources& resources, VerifyResult* all, SetupAgainst against) {
  const auto volume = file.nested(member);
  const auto of_original = [&] {
    return original ? one_of_volumes(*original, member.factor) : std::unique_ptr<VolumeSource>();
  };
  TagReader reader(std::make_unique<SourceStream>(file.bytes_of(member)));
  VerifySetup setup{plan_verifying(reader.parameters(), resources)};
  if (original) setup = against(reader.name(), reader.parameters(), of_original(), resources);
  const Metadata metadata = setup.metadata_of_original;
  VerifyResult found = verify_all(reader, std::move(setup));
  if (original) found.geometry = compare_geometry(found.header.metadata, metadata);
  const auto again = of_original();
  verify_members(*volume, again.get(), resources);
  if (all) sum_up(found, *all);
}

}  // namespace

void verify_members(const TagBricks& file, VolumeSource* original, const Resources& resources,
                    VerifyResult* all, SetupAgainst against) {
  for (const Member& member : file.index().members) {
    if (member.is_volume()) verify_volume(file, member, original, resources, all, against);
    // Whoever read the file front to back has checked this, but not who read its bricks by its index.
    file.check(member);
  }
  std::unique_ptr<VolumeSource> first;
  if (original && file.header().volumes > 1) {
    first = one_of_volumes(*original, 0);
    original = first.get();
  }
  std::optional<OriginalMeans> of_original;
  for (const Member& member : file.index().members) {
    if (!member.is_overview()) continue;
    file.nested(member);
    if (original && !of_original) of_original.emplace(*original, resources.spool.value());
    TagReader reader(std::make_unique<SourceStream>(file.bytes_of(member)));
    VerifySetup setup{plan_verifying(reader.parameters(), resources)};
    if (auto means = of_original ? of_original->means(member.factor) : nullptr)
      setup.against = std::make_unique<AgainstOriginal>(reader.name(), reader.parameters(), std::move(means));
    verify_all(reader, std::move(setup));
  }
}

}  // namespace tagrid
