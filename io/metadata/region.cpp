#include "io/metadata/region.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "io/metadata/fields.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;

/// Lists that mean nothing if they do not have an entry for each slice.
constexpr std::array lists_of_slices = {slice_positions_key, std::string_view("slice_slopes"),
                                        std::string_view("slice_intercepts"),
                                        std::string_view("slice_sop_instance_uids")};
/// Steps that differ by less, relative to their mean, are equal: positions are rounded texts.
constexpr double same_step = 0.01;

// In NRRD's spelling: an unknown number, or one that a reader would refuse, is NaN.
std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "nan"; }
std::string vector(const Vector& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); }

bool is_finite(const Vector& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

Vector difference(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double length(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }
Vector scaled(const Vector& v, double factor) { return {v[0] * factor, v[1] * factor, v[2] * factor}; }

/// The numbers of "x y z"; nothing if it is not like that.
std::optional<Vector> position_of(std::string_view text) {
  const auto words = words_of(text);
  if (words.size() != 3) return std::nullopt;
  Vector place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto coordinate = number_of(words[axis]);
    if (!coordinate) return std::nullopt;
    place[axis] = *coordinate;
  }
  return place;
}

class RegionLines {
 public:
  /// What is kept are samples from `low` on, or with `blocks` the means of blocks of `step` samples.
  RegionLines(std::string_view fields, Index3 low, Index3 step, std::int64_t slices, std::int64_t all_slices,
              bool blocks = false)
      : fields_(fields),
        whole_(geometry_of(fields)),
        low_(low),
        step_(step),
        slices_(slices),
        all_slices_(all_slices),
        blocks_(blocks),
        place_(place_of_first()),
        origin_(to_world(whole_, place_)) {
    // If the spacing is unknown, so is the distance to any other sample.
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (is_moved(axis) && std::isnan(whole_.spacing[axis])) origin_[axis] = Geometry::unknown;
  }

  std::string lines() {
    find_centers();
    find_places_of_slices();
    std::string result;
    for (const NrrdLine& line : nrrd_lines(fields_)) result += changed(line);
    return result + missing_origin();
  }

 private:
  // Of the first one that is kept, in samples.
  Vector place_of_first() const {
    Vector place;
    for (int axis = 0; axis < 3; ++axis)
      place[static_cast<std::size_t>(axis)] =
          static_cast<double>(low_[axis]) + (blocks_ ? static_cast<double>(step_[axis] - 1) / 2 : 0);
    return place;
  }

  std::string changed(const NrrdLine& line) {
    const std::string same = fmt::format("{}\n", line.text);
    if (line.kind == NrrdLine::Kind::key_value)
      return line.key.starts_with("slice_") || line.key == "dicom_added_intercept" ? of_slices(line) : same;
    const bool is_same = low_ == Index3{0, 0, 0} && step_ == Index3{1, 1, 1} && !even_step_;
    if (is_same) return same;
    if (line.field == "spacings") return spacings();
    if (line.field == "thicknesses" && blocks_) return thicknesses(words_of(line.value));
    if (line.field == "space directions") return directions();
    if (line.field == "space origin") {
      has_origin_line_ = true;
      return whole_.has_origin ? space_origin() : same;
    }
    if (line.field == "axis mins" && !whole_.has_directions) {
      has_origin_line_ = true;
      return axis_mins(words_of(line.value));
    }
    // They would be wrong in the region, and nothing else depends on them.
    if (line.field == "axis mins" || line.field == "axis maxs") return "";
    return same;
  }

  // The entries of the slices that are kept, of a list with one for each slice of the whole volume.
  std::string of_slices(const NrrdLine& line) const {
    const bool is_places = line.key == slice_positions_key;
    const std::vector<std::string_view> all = is_places ? positions_in(line.value) : words_of(line.value);
    if (static_cast<std::int64_t>(all.size()) != all_slices_) {
      const bool is_list = std::ranges::find(lists_of_slices, line.key) != lists_of_slices.end();
      return is_list ? "" : fmt::format("{}\n", line.text);
    }
    // A block has no entry of its own but a position.
    if (blocks_ && !is_places) return "";
    if (slices_ == all_slices_ && !is_places) return fmt::format("{}\n", line.text);
    if (is_places && even_step_) return "";
    std::string kept;
    for (std::int64_t z = 0; z < slices_; ++z) {
      const std::string_view entry = all[index_of(z)];
      if (z > 0) kept += is_places ? "; " : " ";
      kept += is_places ? moved_position(entry, all, z) : std::string(entry);
    }
    return fmt::format("{}:={}\n", line.key, kept);
  }
  // The slice of the whole volume that is kept as number z.
  std::size_t index_of(std::int64_t z) const { return static_cast<std::size_t>(low_.z + z * step_.z); }
  // The position of the first sample that is kept of a slice, if `position` is that of its first sample.
  std::optional<Vector> moved(std::string_view position) const {
    auto place = position_of(position);
    for (std::size_t axis = 0; place && axis < 3; ++axis)
      (*place)[axis] =
          (*place)[axis] + place_[0] * whole_.directions[0][axis] + place_[1] * whole_.directions[1][axis];
    return place;
  }
  // The same for slice z of those that are kept; the middle of the slices of a block.
  std::optional<Vector> place_of_slice(const std::vector<std::string_view>& all, std::int64_t z) const {
    if (!blocks_) return moved(all[index_of(z)]);
    const std::size_t first = index_of(z),
                      end = std::min(first + static_cast<std::size_t>(step_.z), all.size());
    Vector sum = {0, 0, 0};
    for (std::size_t i = first; i < end; ++i) {
      const auto place = moved(all[i]);
      if (!place) return std::nullopt;
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += (*place)[axis];
    }
    return scaled(sum, 1 / static_cast<double>(end - first));
  }
  std::string moved_position(std::string_view position, const std::vector<std::string_view>& all,
                             std::int64_t z) const {
    if (!is_moved(0) && !is_moved(1) && !blocks_) return std::string(position);
    const auto place = place_of_slice(all, z);
    return place ? fmt::format("{} {} {}", (*place)[0], (*place)[1], (*place)[2]) : std::string(position);
  }
  // Where slices lie at unequal distances, the first one that is kept is where its own position says. Those
  // that are kept may lie at equal ones.
  void find_places_of_slices() {
    if (!whole_.has_directions || !whole_.has_origin) return;
    for (const auto& [key, value] : key_values_of(fields_)) {
      if (key != slice_positions_key) continue;
      const auto all = positions_in(value);
      if (static_cast<std::int64_t>(all.size()) != all_slices_) return;
      std::vector<Vector> places;
      for (std::int64_t z = 0; z < slices_; ++z)
        if (const auto place = place_of_slice(all, z))
          places.push_back(*place);
        else
          return;
      origin_ = places.front();
      if (slices_ < all_slices_) even_step_ = even_step_of(places);
    }
  }
  // From one slice to the next one, if all steps are equal. A single slice is as thick as it was.
  std::optional<Vector> even_step_of(const std::vector<Vector>& places) const {
    if (places.size() == 1) return scaled(whole_.directions[2], static_cast<double>(step_.z));
    const Vector step =
        scaled(difference(places.back(), places.front()), 1 / static_cast<double>(places.size() - 1));
    const auto& directions = whole_.directions;
    const double volume = determinant({directions[0], directions[1], step});
    if (!std::isfinite(volume) || volume == 0) return std::nullopt;
    for (std::size_t z = 1; z < places.size(); ++z)
      if (length(difference(difference(places[z], places[z - 1]), step)) > same_step * length(step))
        return std::nullopt;
    return step;
  }

  std::string spacings() const {
    std::string line = "spacings:";
    for (int axis = 0; axis < 3; ++axis)
      line += ' ' + number(whole_.spacing[static_cast<std::size_t>(axis)] * static_cast<double>(step_[axis]));
    return line + '\n';
  }
  // A block reaches from the low end of its first sample to the high end of its last one.
  std::string thicknesses(const std::vector<std::string_view>& whole) const {
    std::string line = "thicknesses:";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double one =
          axis < whole.size() ? number_of(whole[axis]).value_or(Geometry::unknown) : Geometry::unknown;
      line +=
          ' ' + number(one + static_cast<double>(step_[static_cast<int>(axis)] - 1) * whole_.spacing[axis]);
    }
    return line + '\n';
  }
  // NRRD has no notation for an unknown vector.
  std::string directions() const {
    std::string line = "space directions:";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vector along =
          axis == 2 && even_step_
              ? *even_step_
              : scaled(whole_.directions[axis], static_cast<double>(step_[static_cast<int>(axis)]));
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
  bool is_moved(std::size_t axis) const { return place_[axis] != 0; }

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
    for (const NrrdLine& line : nrrd_lines(fields_)) {
      if (line.field != "centers") continue;
      const auto words = words_of(line.value);
      for (std::size_t axis = 0; axis < 3 && axis < words.size(); ++axis)
        at_point_[axis] = lower_case(words[axis]) == "node";
    }
  }

  std::string_view fields_;
  Geometry whole_;
  Index3 low_, step_;
  std::int64_t slices_, all_slices_;
  bool blocks_;
  Vector place_;   ///< of the first sample that is kept, in samples
  Vector origin_;  ///< of the first sample that is kept; NaN on an axis where it is unknown
  std::optional<Vector>
      even_step_;  ///< of slices whose positions are known, if they are kept at equal distances
  std::array<bool, 3> at_point_ = {};
  bool has_origin_line_ = false;
};

}  // namespace

std::string fields_of_region(std::string_view nrrd_fields, Index3 low, Index3 step, std::int64_t slices,
                             std::int64_t all_slices) {
  return RegionLines(nrrd_fields, low, step, slices, all_slices).lines();
}

std::string fields_of_overview(std::string_view nrrd_fields, std::int64_t factor, std::int64_t all_slices) {
  return RegionLines(nrrd_fields, {0, 0, 0}, {factor, factor, factor}, (all_slices - 1) / factor + 1,
                     all_slices, true)
      .lines();
}

std::vector<std::string_view> positions_in(std::string_view list) {
  if (list.empty()) return {};
  if (list.ends_with(';')) list.remove_suffix(1);
  std::vector<std::string_view> positions = split(list, ';');
  for (std::string_view& position : positions) position = trimmed(position);
  return positions;
}

std::vector<double> slice_distances(std::string_view nrrd_fields, std::int64_t slices) {
  const std::string list = text_of_key(nrrd_fields, slice_positions_key);
  std::vector<Vector> places;
  for (const std::string_view position : positions_in(list)) {
    const auto place = position_of(position);
    if (!place || !is_finite(*place)) return {};
    places.push_back(*place);
  }
  if (static_cast<std::int64_t>(places.size()) != slices) return {};
  std::vector<double> distances;
  for (const Vector& place : places) distances.push_back(length(difference(place, places.front())));
  return distances;
}

}  // namespace tagrid
