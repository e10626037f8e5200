#include "io/metadata/region.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

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

class Region {
 public:
  /// What is kept are samples from `low` on, or with `blocks` the means of blocks of `step` samples.
  Region(const Metadata& whole, Index3 low, Index3 step, std::int64_t slices, std::int64_t all_slices,
         bool blocks = false)
      : entries_(whole.entries()),
        whole_(whole.geometry()),
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
    find_centers();
    if (const auto positions = whole.value(slice_positions_key)) find_places_of_slices(*positions);
  }

  Metadata metadata() {
    for (const MetadataEntry& entry : entries_) add(entry);
    add_missing_origin();
    return Metadata(std::move(kept_));
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

  void add(const MetadataEntry& entry) {
    if (entry.kind == MetadataEntry::Kind::pair) {
      const bool is_of_slices = entry.key.starts_with("slice_") || entry.key == "dicom_added_intercept";
      return is_of_slices ? add_of_slices(entry) : kept_.add(entry);
    }
    const bool is_same = low_ == Index3{0, 0, 0} && step_ == Index3{1, 1, 1} && !even_step_;
    if (is_same) return kept_.add(entry);
    if (entry.field == "spacings") return add_spacings();
    if (entry.field == "thicknesses" && blocks_) return add_thicknesses(words_of(entry.value));
    if (entry.field == "space directions") return add_directions();
    if (entry.field == "space origin") {
      has_origin_field_ = true;
      return whole_.has_origin ? add_space_origin() : kept_.add(entry);
    }
    if (entry.field == "axis mins" && !whole_.has_directions) {
      has_origin_field_ = true;
      return add_axis_mins(words_of(entry.value));
    }
    // They would be wrong in the region, and nothing else depends on them.
    if (entry.field == "axis mins" || entry.field == "axis maxs") return;
    kept_.add(entry);
  }

  // The entries of the slices that are kept, of a list with one for each slice of the whole volume.
  void add_of_slices(const MetadataEntry& entry) {
    const bool is_places = entry.key == slice_positions_key;
    const std::vector<std::string_view> all = is_places ? positions_in(entry.value) : words_of(entry.value);
    if (static_cast<std::int64_t>(all.size()) != all_slices_) {
      const bool is_list = std::ranges::find(lists_of_slices, entry.key) != lists_of_slices.end();
      if (!is_list) kept_.add(entry);
      return;
    }
    // A block has no entry of its own but a position.
    if (blocks_ && !is_places) return;
    if (slices_ == all_slices_ && !is_places) return kept_.add(entry);
    if (is_places && even_step_) return;
    std::string list;
    for (std::int64_t z = 0; z < slices_; ++z) {
      const std::string_view of_slice = all[index_of(z)];
      if (z > 0) list += is_places ? "; " : " ";
      list += is_places ? moved_position(of_slice, all, z) : std::string(of_slice);
    }
    kept_.add_written_pair(entry.key, list);
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
  void find_places_of_slices(std::string_view positions) {
    if (!whole_.has_directions || !whole_.has_origin) return;
    const auto all = positions_in(positions);
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

  void add_spacings() {
    std::vector<std::string> numbers;
    for (int axis = 0; axis < 3; ++axis)
      numbers.push_back(
          number(whole_.spacing[static_cast<std::size_t>(axis)] * static_cast<double>(step_[axis])));
    kept_.add_field("spacings", fmt::format("{}", fmt::join(numbers, " ")));
  }
  // A block reaches from the low end of its first sample to the high end of its last one.
  void add_thicknesses(const std::vector<std::string_view>& whole) {
    std::vector<std::string> numbers;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double one =
          axis < whole.size() ? number_of(whole[axis]).value_or(Geometry::unknown) : Geometry::unknown;
      numbers.push_back(
          number(one + static_cast<double>(step_[static_cast<int>(axis)] - 1) * whole_.spacing[axis]));
    }
    kept_.add_field("thicknesses", fmt::format("{}", fmt::join(numbers, " ")));
  }
  // NRRD has no notation for an unknown vector.
  void add_directions() {
    std::vector<std::string> vectors;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vector along =
          axis == 2 && even_step_
              ? *even_step_
              : scaled(whole_.directions[axis], static_cast<double>(step_[static_cast<int>(axis)]));
      if (!is_finite(along)) return;
      vectors.push_back(vector(along));
    }
    kept_.add_field("space directions", fmt::format("{}", fmt::join(vectors, " ")));
  }
  void add_space_origin() {
    if (is_finite(origin_)) kept_.add_field("space origin", vector(origin_));
  }
  // `whole` are the axis mins of the whole volume, if it has them.
  void add_axis_mins(const std::vector<std::string_view>& whole = {}) {
    std::vector<std::string> numbers;
    for (std::size_t axis = 0; axis < 3; ++axis)
      numbers.push_back(axis < whole.size() ? changed_min(axis, whole[axis]) : number(axis_min(axis)));
    kept_.add_field("axis mins", fmt::format("{}", fmt::join(numbers, " ")));
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
  void add_missing_origin() {
    if (has_origin_field_) return;
    bool is_elsewhere = false;
    for (std::size_t axis = 0; axis < 3; ++axis)
      is_elsewhere |= is_moved(axis) && !std::isnan(whole_.spacing[axis]);
    if (is_elsewhere) whole_.has_directions ? add_space_origin() : add_axis_mins();
  }

  void find_centers() {
    for (const MetadataEntry& entry : entries_) {
      if (entry.field != "centers") continue;
      const auto words = words_of(entry.value);
      for (std::size_t axis = 0; axis < 3 && axis < words.size(); ++axis)
        at_point_[axis] = lower_case(words[axis]) == "node";
    }
  }

  const MetadataEntries& entries_;
  const Geometry& whole_;
  MetadataEntries kept_;
  Index3 low_, step_;
  std::int64_t slices_, all_slices_;
  bool blocks_;
  Vector place_;   ///< of the first sample that is kept, in samples
  Vector origin_;  ///< of the first sample that is kept; NaN on an axis where it is unknown
  std::optional<Vector>
      even_step_;  ///< of slices whose positions are known, if they are kept at equal distances
  std::array<bool, 3> at_point_ = {};
  bool has_origin_field_ = false;
};

}  // namespace

Metadata metadata_of_region(const Metadata& whole, Index3 low, Index3 step, std::int64_t slices,
                            std::int64_t all_slices) {
  return Region(whole, low, step, slices, all_slices).metadata();
}

Metadata metadata_of_overview(const Metadata& whole, std::int64_t factor, std::int64_t all_slices) {
  return Region(whole, {0, 0, 0}, {factor, factor, factor}, (all_slices - 1) / factor + 1, all_slices, true)
      .metadata();
}

std::vector<std::string_view> positions_in(std::string_view list) {
  if (list.empty()) return {};
  if (list.ends_with(';')) list.remove_suffix(1);
  std::vector<std::string_view> positions = split(list, ';');
  for (std::string_view& position : positions) position = trimmed(position);
  return positions;
}

std::vector<double> slice_distances(const Metadata& metadata, std::int64_t slices) {
  const std::string list = metadata.text_of(slice_positions_key);
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
