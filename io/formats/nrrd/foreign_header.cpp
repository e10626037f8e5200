#include "io/formats/nrrd/header.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "io/formats/nrrd/axes.h"
#include "io/metadata/entries.h"
#include "io/metadata/fields.h"
#include "io/metadata/region.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"
#include "io/volume/volume_info.h"

namespace tagrid {
namespace {

using Vectors = std::vector<std::vector<double>>;

bool is_unknown(std::string_view word) {
  const auto number = number_of(word);
  return number && std::isnan(*number);
}

/// Reads the lines of a header, from front to back.
class Reading {
 public:
  Reading(std::string_view text, const std::vector<MetadataEntry>& lines) : changes_(text) {
    for (const MetadataEntry& entry : lines) {
      has_spacings_ = has_spacings_ || entry.field == "spacings";
      if (entry.field == "dimension" && axes_ == 0)
        axes_ = static_cast<std::size_t>(std::max<std::int64_t>(whole_number_of(entry.value).value_or(0), 0));
    }
  }

  void read_field(const MetadataEntry& entry) {
    if (entry.field == "spacings")
      read_numbers(entry, "the spacing along this axis is unknown", true);
    else if (entry.field == "axis mins")
      read_numbers(entry, "the position along this axis is unknown", false);
    else if (entry.field == "axis maxs" || entry.field == "thicknesses")
      read_numbers(entry, "it is left out", false);
    else if (entry.field == "space directions")
      read_directions(entry);
    else if (entry.field == "space origin")
      read_origin(entry);
    else if (entry.field == "old min" || entry.field == "old max")
      read_old_range(entry);
    else if (entry.field == "block size")
      read_block_size(entry);
  }

  void read_pair(const MetadataEntry& entry) {
    const std::string_view key = entry.key, value = entry.value;
    if (key == slice_positions_key) read_positions(value);
    if (is_of_a_label(key)) read_label(key);
    if (key != "rescale_slope" && key != "rescale_intercept") return;
    // The line of an unreadable number stays, so that the doubt does, too; see doubt_of_rescale().
    const ForeignNumber number = foreign_number(value);
    if (!number.decimal_comma) return;
    warn(remark_on(number, key, ""));
    changes_.replace(value, fmt::format("{}", number.value));
  }

  ForeignNrrdHeader finish() {
    result_.text = changes_.finish();
    return std::move(result_);
  }

 private:
  void warn(const std::string& sentence) { result_.warnings.push_back("NRRD header: " + sentence); }
  void comment_out(const MetadataEntry& entry) {
    changes_.replace(entry.line, fmt::format("# {}", entry.line));
  }

  /// A field with a number for each axis.
  void read_numbers(const MetadataEntry& entry, std::string_view consequence, bool is_length) {
    const ForeignNumbers numbers = foreign_numbers(entry.value, axes_);
    const auto words = words_of(entry.value);
    if (numbers.numbers.empty()) {
      warn(remark_on(numbers, entry.field, "it is left out"));
      return comment_out(entry);
    }
    for (std::size_t axis = 0; axis < axes_; ++axis) {
      const ForeignNumber& number = numbers.numbers[axis];
      if (is_unknown(words[axis])) continue;
      const bool is_zero = is_length && number.is_number() && number.value == 0;
      std::string remark =
          remark_on(number, fmt::format("of {} {}, number {}", entry.field, quoted(entry.value), axis + 1),
                    consequence);
      if (is_zero)
        remark = fmt::format("of {} {}, number {} is 0; {}", entry.field, quoted(entry.value), axis + 1,
                             consequence);
      if (remark.empty()) continue;
      warn(remark);
      changes_.replace(words[axis],
                       is_zero || number.is_unreadable() ? "nan" : fmt::format("{}", number.value));
    }
  }

  /// The vectors of all axes; "none" is an empty one. Nothing if they are not like that.
  std::optional<Vectors> directions_in(std::string_view value) const {
    const auto parts = vectors_in(value);
    if (!parts || parts->size() != axes_) return std::nullopt;
    Vectors vectors;
    std::size_t size = 0;
    for (const std::string_view part : *parts) {
      if (lower_case(part) == "none") {
        vectors.emplace_back();
        continue;
      }
      auto vector = vector_of(part);
      if (!vector || std::ranges::any_of(*vector, [](double n) { return std::isinf(n); }))
        return std::nullopt;
      // A vector of NaN is an unknown one, and refused as "none" is.
      const auto unknown = std::ranges::count_if(*vector, [](double n) { return std::isnan(n); });
      if (unknown != 0 && unknown != std::ssize(*vector)) return std::nullopt;
      if (size != 0 && vector->size() != size) return std::nullopt;
      size = vector->size();
      vectors.push_back(std::move(*vector));
    }
    return vectors;
  }

  /// False if axes have directions that lie in a line or a plane.
  static bool span(const Vectors& directions) {
    Vectors vectors;
    for (const auto& vector : directions)
      if (!vector.empty() && !std::isnan(vector[0])) vectors.push_back(vector);
    for (auto& vector : vectors) vector.resize(3);
    if (vectors.size() == 3) {
      std::array<std::array<double, 3>, 3> matrix;
      for (std::size_t axis = 0; axis < 3; ++axis) std::ranges::copy(vectors[axis], matrix[axis].begin());
      const double volume = determinant(matrix);
      return volume != 0 && std::isfinite(volume);
    }
    if (vectors.size() != 2) return true;
    const auto &u = vectors[0], &v = vectors[1];
    return u[1] * v[2] != u[2] * v[1] || u[2] * v[0] != u[0] * v[2] || u[0] * v[1] != u[1] * v[0];
  }

  void read_directions(const MetadataEntry& entry) {
    const auto directions = directions_in(entry.value);
    if (!directions) {
      warn(
          fmt::format("space directions {} are not {} vectors of numbers; spacing and directions are unknown",
                      quoted(entry.value), axes_));
      return comment_out(entry);
    }
    if (span(*directions)) return;
    warn(
        fmt::format("space directions {} do not span a volume; directions are unknown", quoted(entry.value)));
    if (has_spacings_) return comment_out(entry);
    std::vector<double> lengths;
    for (const auto& vector : *directions) {
      double sum = 0;
      for (const double number : vector) sum += number * number;
      lengths.push_back(sum > 0 && std::isfinite(sum) ? std::sqrt(sum) : Geometry::unknown);
    }
    changes_.replace(entry.line, fmt::format("spacings: {}", fmt::join(lengths, " ")));
  }

  void read_origin(const MetadataEntry& entry) {
    const auto origin = vector_of(entry.value);
    const auto unknown = origin ? std::ranges::count_if(*origin, [](double n) { return std::isnan(n); }) : 0;
    const bool is_readable = origin && (origin->size() == 3 || (origin->size() == 2 && axes_ == 2)) &&
                             std::ranges::none_of(*origin, [](double n) { return std::isinf(n); }) &&
                             (unknown == 0 || unknown == std::ssize(*origin));
    if (is_readable) return;
    warn(fmt::format("space origin {} is not a vector of numbers; where the volume lies is unknown",
                     quoted(entry.value)));
    comment_out(entry);
  }

  /// "Segment0_LabelValue": 3D Slicer says so that samples of this number belong to a segment.
  static bool is_of_a_label(std::string_view key) {
    constexpr std::string_view before = "Segment", after = "_LabelValue";
    if (!key.starts_with(before) || !key.ends_with(after) || key.size() <= before.size() + after.size())
      return false;
    return std::ranges::all_of(key.substr(before.size(), key.size() - before.size() - after.size()),
                               is_digit);
  }
  /// Said once, however many labels there are.
  void read_label(std::string_view key) {
    if (has_labels_) return;
    has_labels_ = true;
    result_.not_understood.push_back(fmt::format(
        "NRRD header: {} says that samples are labels, but they will be treated as intensities", key));
  }

  void read_positions(std::string_view list) {
    for (const std::string_view position : positions_in(list))
      if (const ForeignNumbers numbers = foreign_numbers(position, 3); !numbers.are_numbers())
        return warn(remark_on(numbers, "of slice_positions,", "where this slice lies is unknown"));
  }

  /// Programs that quantize values note what range they had.
  void read_old_range(const MetadataEntry& entry) {
    if (is_unknown(entry.value)) return;
    result_.not_understood.push_back(
        fmt::format("NRRD header: {} {} says that samples are quantized values; they are taken as they are, "
                    "and not turned back",
                    entry.field, quoted(entry.value)));
    if (foreign_number(entry.value).is_unreadable()) comment_out(entry);
  }

  /// Blocks are refused by their type. Beside another one, teem reads no file with this field.
  void read_block_size(const MetadataEntry& entry) {
    warn(fmt::format("block size {}: samples are no blocks; it is left out", quoted(entry.value)));
    comment_out(entry);
  }

  TextChanges changes_;
  std::size_t axes_ = 0;  ///< 0 if the header does not say it
  bool has_spacings_ = false, has_labels_ = false;
  ForeignNrrdHeader result_;
};

/// The lines after the magic, up to the blank line or the names of files.
std::vector<MetadataEntry> lines_in(std::string_view text) {
  std::vector<MetadataEntry> lines;
  take_line(text);
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (line.empty()) break;
    lines.push_back(entry_of_line(line));
    if (lines.back().field == "data file" && lines.back().value.starts_with("LIST")) break;
  }
  return lines;
}

}  // namespace

ForeignNrrdHeader foreign_nrrd_header(std::string_view text) {
  const std::vector<MetadataEntry> lines = lines_in(text);
  Reading reading(text, lines);
  for (const MetadataEntry& entry : lines)
    if (entry.kind == MetadataEntry::Kind::field)
      reading.read_field(entry);
    else if (entry.kind == MetadataEntry::Kind::pair)
      reading.read_pair(entry);
  return reading.finish();
}

}  // namespace tagrid
