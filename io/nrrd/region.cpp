#include "io/nrrd/region.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "io/files/text.h"
#include "io/nrrd/geometry.h"
#include "io/nrrd/line.h"
#include "io/nrrd/slice_positions.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;

// In NRRD's spelling: an unknown number, or one that a reader would refuse, is NaN.
std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "nan"; }
std::string vector(const Vector& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); }

bool is_finite(const Vector& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

Vector scaled(const Vector& v, double factor) { return {v[0] * factor, v[1] * factor, v[2] * factor}; }

class RegionLines {
 public:
  RegionLines(std::string_view fields, Index3 low, Index3 step, std::int64_t slices)
      : fields_(fields),
        whole_(geometry_of(fields)),
        low_(low),
        step_(step),
        slices_(slices),
        origin_(to_world(whole_, low)) {
    // If the spacing is unknown, so is the distance to any other sample.
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (is_moved(axis) && std::isnan(whole_.spacing[axis])) origin_[axis] = Geometry::unknown;
  }

  std::string lines() {
    find_centers();
    find_origin_of_slice();
    std::string result;
    for (std::string_view rest = fields_; !rest.empty();) {
      const std::string_view line = take_line(rest);
      result += changed(line, parse_nrrd_line(line));
    }
    return result + missing_origin();
  }

 private:
  std::string changed(std::string_view line, const NrrdLine& parsed) {
    if (parsed.kind == NrrdLine::Kind::key_value)
      for (const std::string_view key :
           {slice_positions_key, std::string_view("slice_slopes"), std::string_view("slice_intercepts")})
        if (line.starts_with(key) && line.substr(key.size()).starts_with(":=")) return of_slices(line, key);
    const bool is_same = low_ == Index3{0, 0, 0} && step_ == Index3{1, 1, 1};
    if (is_same) return fmt::format("{}\n", line);
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
    // They would be wrong in the region, and nothing else depends on them.
    if (parsed.field == "axis mins" || parsed.field == "axis maxs") return "";
    return fmt::format("{}\n", line);
  }

  // A list with one entry for each slice of the whole volume. A list that is too short is dropped.
  std::string of_slices(std::string_view line, std::string_view key) const {
    const bool is_places = key == slice_positions_key;
    const std::string_view list = line.substr(key.size() + 2);
    const std::vector<std::string_view> all = is_places ? positions_in(list) : words_of(list);
    std::string kept;
    for (std::int64_t z = 0; z < slices_; ++z) {
      const auto at = static_cast<std::size_t>(low_.z + z * step_.z);
      if (at >= all.size()) return "";
      if (z > 0) kept += is_places ? "; " : " ";
      kept += is_places ? moved_position(all[at]) : std::string(all[at]);
    }
    return fmt::format("{}:={}\n", key, kept);
  }
  // The position of the first sample that is kept of a slice, if `position` is that of its first sample.
  std::optional<Vector> moved(std::string_view position) const {
    const auto words = words_of(position);
    Vector place;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto coordinate = words.size() == 3 ? number_of(words[axis]) : std::nullopt;
      if (!coordinate) return std::nullopt;
      place[axis] = *coordinate + static_cast<double>(low_.x) * whole_.directions[0][axis] +
                    static_cast<double>(low_.y) * whole_.directions[1][axis];
    }
    return place;
  }
  std::string moved_position(std::string_view position) const {
    if (low_.x == 0 && low_.y == 0) return std::string(position);
    const auto place = moved(position);
    return place ? fmt::format("{} {} {}", (*place)[0], (*place)[1], (*place)[2]) : std::string(position);
  }
  // Where slices lie at unequal distances, the first one that is kept is where its own position says.
  void find_origin_of_slice() {
    if (!whole_.has_directions || !whole_.has_origin) return;
    for (const auto& [key, value] : key_values_of(fields_)) {
      if (key != slice_positions_key) continue;
      const auto all = positions_in(value);
      if (static_cast<std::size_t>(low_.z) >= all.size()) return;
      if (const auto place = moved(all[static_cast<std::size_t>(low_.z)])) origin_ = *place;
    }
  }

  std::string spacings() const {
    std::string line = "spacings:";
    for (int axis = 0; axis < 3; ++axis)
      line += ' ' + number(whole_.spacing[static_cast<std::size_t>(axis)] * static_cast<double>(step_[axis]));
    return line + '\n';
  }
  // NRRD has no notation for an unknown vector.
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
  // `whole` are the axis mins of the whole volume, if it has them.
  std::string axis_mins(const std::vector<std::string_view>& whole = {}) const {
    std::string line = "axis mins:";
    for (std::size_t axis = 0; axis < 3; ++axis)
      line += ' ' + (axis < whole.size() ? changed_min(axis, whole[axis]) : number(axis_min(axis)));
    return line + '\n';
  }
  std::string changed_min(std::size_t axis, std::string_view of_whole) const {
    const bool is_known = !std::isnan(number_of(of_whole).value_or(Geometry::unknown));
    // The origin is the same sample, and its extent is unknown.
    if (is_known && !is_moved(axis) && std::isnan(whole_.spacing[axis])) return std::string(of_whole);
    return number(is_known ? axis_min(axis) : Geometry::unknown);
  }
  // The low edge of the first sample that is kept, or its position if samples are points. Only without
  // directions.
  double axis_min(std::size_t axis) const {
    if (at_point_[axis]) return origin_[axis];
    return origin_[axis] - static_cast<double>(step_[static_cast<int>(axis)]) * whole_.spacing[axis] / 2;
  }
  bool is_moved(std::size_t axis) const { return low_[static_cast<int>(axis)] != 0; }

  // Without an origin in its header, the first sample of the whole volume was at (0, 0, 0). A region must
  // state the position of its first sample.
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
  std::int64_t slices_;
  Vector origin_;  ///< of the first sample that is kept; NaN on an axis where it is unknown
  std::array<bool, 3> at_point_ = {};
  bool has_origin_line_ = false;
};

}  // namespace

std::string fields_of_region(std::string_view nrrd_fields, Index3 low, Index3 step, std::int64_t slices) {
  return RegionLines(nrrd_fields, low, step, slices).lines();
}

}  // namespace tagrid
