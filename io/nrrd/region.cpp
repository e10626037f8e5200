#include "io/nrrd/region.h"

#include <fmt/format.h>

#include <cmath>

#include "io/nrrd/geometry.h"
#include "io/nrrd/line.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;

// As NRRD spells it.
std::string number(double value) { return std::isnan(value) ? "nan" : fmt::format("{}", value); }
std::string vector(const Vector& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); }

Vector scaled(const Vector& v, double factor) { return {v[0] * factor, v[1] * factor, v[2] * factor}; }

// Where the first sample that is kept begins, or lies where samples are points, on an axis. Without directions.
double axis_min(const Geometry& whole, const Vector& origin, double step, std::size_t axis, bool at_point) {
  const double spacing = std::isnan(whole.spacing[axis]) ? 1 : whole.spacing[axis];
  return at_point ? origin[axis] : origin[axis] - step * spacing / 2;
}

class RegionLines {
 public:
  RegionLines(std::string_view fields, Index3 low, Index3 step)
      : fields_(fields), whole_(geometry_of(fields)), step_(step), origin_(to_world(whole_, low)) {
    moved_ = low != Index3{0, 0, 0};
  }

  std::string lines() {
    find_centers();
    std::string result;
    for (std::string_view rest = fields_; !rest.empty();) {
      const std::string_view line = take_line(rest);
      result += changed(line, parse_nrrd_line(line));
    }
    return result + missing_origin();
  }

 private:
  std::string changed(std::string_view line, const NrrdLine& parsed) {
    if (parsed.field == "spacings") return spacings();
    if (parsed.field == "space directions") return directions();
    if (parsed.field == "space origin") {
      has_origin_line_ = true;
      return fmt::format("space origin: {}\n", vector(origin_));
    }
    if (parsed.field == "axis mins" && !whole_.has_directions) {
      has_origin_line_ = true;
      return axis_mins();
    }
    // They would be wrong, and nothing else depends on them.
    if (parsed.field == "axis mins" || parsed.field == "axis maxs") return "";
    return fmt::format("{}\n", line);
  }

  std::string spacings() const {
    std::string line = "spacings:";
    for (int axis = 0; axis < 3; ++axis)
      line += ' ' + number(whole_.spacing[static_cast<std::size_t>(axis)] * static_cast<double>(step_[axis]));
    return line + '\n';
  }
  std::string directions() const {
    std::string line = "space directions:";
    for (int axis = 0; axis < 3; ++axis)
      line += ' ' + vector(scaled(whole_.directions[static_cast<std::size_t>(axis)],
                                  static_cast<double>(step_[axis])));
    return line + '\n';
  }
  std::string axis_mins() const {
    std::string line = "axis mins:";
    for (std::size_t axis = 0; axis < 3; ++axis)
      line += ' ' + number(axis_min(whole_, origin_, static_cast<double>(step_[static_cast<int>(axis)]), axis,
                                    at_point_[axis]));
    return line + '\n';
  }
  // The first sample of the whole was at the origin without a word; the first one of a region has to say where it is.
  std::string missing_origin() const {
    if (!moved_ || has_origin_line_ || !whole_.has_spacing) return "";
    return whole_.has_directions ? fmt::format("space origin: {}\n", vector(origin_)) : axis_mins();
  }

  void find_centers() {
    for (std::string_view rest = fields_; !rest.empty();) {
      const NrrdLine line = parse_nrrd_line(take_line(rest));
      if (line.field != "centers") continue;
      const auto words = words_of(line.value);
      for (std::size_t axis = 0; axis < 3 && axis < words.size(); ++axis)
        at_point_[axis] = lower_case(words[axis]) == "node";
    }
  }

  std::string_view fields_;
  Geometry whole_;
  Index3 step_;
  Vector origin_;  ///< of the first sample that is kept
  std::array<bool, 3> at_point_ = {};
  bool moved_ = false, has_origin_line_ = false;
};

}  // namespace

std::string fields_of_region(std::string_view nrrd_fields, Index3 low, Index3 step) {
  if (low == Index3{0, 0, 0} && step == Index3{1, 1, 1}) return std::string(nrrd_fields);
  return RegionLines(nrrd_fields, low, step).lines();
}

}  // namespace tagrid
