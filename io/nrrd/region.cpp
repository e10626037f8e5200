#include "io/nrrd/region.h"

#include <fmt/format.h>

#include <cmath>

#include "io/nrrd/geometry.h"
#include "io/nrrd/line.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;

// As NRRD spells it: what is not known, or no number that a reader takes, is NaN.
std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "nan"; }
std::string vector(const Vector& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); }

bool is_finite(const Vector& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

Vector scaled(const Vector& v, double factor) { return {v[0] * factor, v[1] * factor, v[2] * factor}; }

class RegionLines {
 public:
  RegionLines(std::string_view fields, Index3 low, Index3 step)
      : fields_(fields), whole_(geometry_of(fields)), low_(low), step_(step), origin_(to_world(whole_, low)) {
    // Nobody knows how far samples are that are an unknown distance apart.
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (is_moved(axis) && std::isnan(whole_.spacing[axis])) origin_[axis] = Geometry::unknown;
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
      return whole_.has_origin ? space_origin() : fmt::format("{}\n", line);
    }
    if (parsed.field == "axis mins" && !whole_.has_directions) {
      has_origin_line_ = true;
      return axis_mins(words_of(parsed.value));
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
  // A vector has no word for what is not known.
  std::string directions() const {
    std::string line = "space directions:";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vector along =
          scaled(whole_.directions[axis], static_cast<double>(step_[static_cast<int>(axis)]));
      if (!is_finite(along)) return "";
      line += ' ' + vector(along);
    }
    return line + '\n';
  }
  std::string space_origin() const {
    return is_finite(origin_) ? fmt::format("space origin: {}\n", vector(origin_)) : "";
  }
  // `whole` are those of the whole volume, where it has them.
  std::string axis_mins(const std::vector<std::string_view>& whole = {}) const {
    std::string line = "axis mins:";
    for (std::size_t axis = 0; axis < 3; ++axis)
      line += ' ' + (axis < whole.size() ? changed_min(axis, whole[axis]) : number(axis_min(axis)));
    return line + '\n';
  }
  std::string changed_min(std::size_t axis, std::string_view of_whole) const {
    const bool is_known = !std::isnan(number_of(of_whole).value_or(Geometry::unknown));
    // The same sample, and it is not known how far around it reaches.
    if (is_known && !is_moved(axis) && std::isnan(whole_.spacing[axis])) return std::string(of_whole);
    return number(is_known ? axis_min(axis) : Geometry::unknown);
  }
  // Where the first sample that is kept begins, or lies where samples are points. Without directions.
  double axis_min(std::size_t axis) const {
    if (at_point_[axis]) return origin_[axis];
    return origin_[axis] - static_cast<double>(step_[static_cast<int>(axis)]) * whole_.spacing[axis] / 2;
  }
  bool is_moved(std::size_t axis) const { return low_[static_cast<int>(axis)] != 0; }

  // The first sample of the whole was at the origin without a word; the first one of a region has to say where it is.
  std::string missing_origin() const {
    if (has_origin_line_) return "";
    bool is_elsewhere = false;
    for (std::size_t axis = 0; axis < 3; ++axis)
      is_elsewhere |= is_moved(axis) && !std::isnan(whole_.spacing[axis]);
    if (!is_elsewhere) return "";
    return whole_.has_directions ? space_origin() : axis_mins();
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
  Index3 low_, step_;
  Vector origin_;  ///< of the first sample that is kept; NaN on an axis where it is not known
  std::array<bool, 3> at_point_ = {};
  bool has_origin_line_ = false;
};

}  // namespace

std::string fields_of_region(std::string_view nrrd_fields, Index3 low, Index3 step) {
  if (low == Index3{0, 0, 0} && step == Index3{1, 1, 1}) return std::string(nrrd_fields);
  return RegionLines(nrrd_fields, low, step).lines();
}

}  // namespace tagrid
