// What is known of a volume besides its size and its samples: where they lie, what they mean, and all else that
// its source said of it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/metadata/entries.h"
#include "io/metadata/geometry.h"

namespace tagrid {

/// What samples mean: value = slope * sample + intercept.
struct Rescale {
  double slope = 1, intercept = 0;
  std::string units = "";  ///< of the values; "" if unknown

  bool operator==(const Rescale&) const = default;
};

/// Names and texts.
using KeyValues = std::vector<std::pair<std::string, std::string>>;

/// The entries of a description, in the order of the source and as it wrote them, and what follows from them.
/// Fields that say how samples are stored (type, dimension, sizes, encoding, endian, data file, skips) are not
/// among them. See text.h for how files have it.
class Metadata {
 public:
  Metadata() = default;
  /// Throws BrokenInput if a field does not belong here, is given twice, or has content that is not supported.
  explicit Metadata(MetadataEntries entries);
  /// The description with this geometry and these pairs. Reading its entries gives the same numbers. Throws as
  /// above.
  explicit Metadata(const Geometry& geometry, const KeyValues& pairs = {});

  const MetadataEntries& entries() const { return entries_; }
  bool empty() const { return entries_.empty(); }

  /// The position of the samples. An origin that no entry states is that of set_origin().
  const Geometry& geometry() const { return geometry_; }
  /// For samples of a part of a volume: where the first one lies, along axes of which no entry states it.
  void set_origin(const std::array<double, 3>& origin) { geometry_.origin = origin; }

  /// The text of a key; nothing if the key is absent. Of equal keys, the last one counts, as in teem.
  std::optional<std::string> value(std::string_view key) const;
  /// The same; "" if the key is absent.
  std::string text_of(std::string_view key) const { return value(key).value_or(""); }
  /// All key-value pairs, in order. Of equal keys, the last one counts, at the place of the first one.
  KeyValues pairs() const;
  void add_pairs(const KeyValues& pairs);
  /// The value is written as in MetadataEntry::value. Throws BrokenInput if the pair does not fit into a line.
  void add_written_pair(std::string_view key, std::string_view value);
  /// Removes all pairs with this key.
  void erase(std::string_view key);

  /// The slope, intercept and units of the values: those that add_rescale() added. If there are none, if they
  /// are not finite numbers, or if each slice has its own, values are the samples.
  const Rescale& rescale() const { return rescale_; }
  /// True if each slice has a slope of its own (slice_slopes).
  bool has_slopes_of_slices() const { return has_slopes_of_slices_; }
  /// The slope with which an error of values becomes the error of samples that is safe for all slices: that of
  /// rescale() or the largest of slice_slopes.
  double largest_slope() const { return largest_slope_; }
  /// The slope and intercept with which bounds on values become bounds on samples: those of rescale(), or the
  /// largest slope and no intercept if each slice has its own.
  Rescale rescale_of_bounds() const;

  bool operator==(const Metadata& other) const { return entries_ == other.entries_; }

 private:
  void find_rescale();

  MetadataEntries entries_;
  Geometry geometry_;
  Rescale rescale_;
  double largest_slope_ = 1;
  bool has_slopes_of_slices_ = false;
};

/// The pairs that stay true if samples get other places: all but the positions of slices.
KeyValues pairs_without_places(const Metadata& metadata);

/// The description without what is not needed to understand the samples: of key-value pairs, only slopes, intercepts,
/// units and positions of slices stay, given spacings, where an OpenVDB grid lies, that there are doubts, and that
/// samples have a loss; of fields, those that describe the geometry and the values. Of all these, only numbers stay, and
/// units and names of spaces that are known: a text of a header may name a person.
Metadata stripped(const Metadata& metadata);
/// True if the description has no entries but those, with any text, and those of OpenVDB grids.
bool has_only_needed(const Metadata& metadata);

}  // namespace tagrid
