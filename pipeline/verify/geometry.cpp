#include "pipeline/verify/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"

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
    found_.neither_says_anything = !says_something(ours_) && !says_something(theirs_);
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

}  // namespace tagrid
