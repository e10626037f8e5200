// What a decoded volume has: stored samples, or the values that they mean.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "io/errors/errors.h"
#include "io/formats/table/formats.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "stages/brick/codec.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/value_rule.h"

namespace tagrid {

/// What is written.
enum class Numbers : std::uint8_t {
  /// Values if the format cannot store slope and intercept, and values fit 16-bit integers: the slope is 1,
  /// and the intercept is a whole number. Otherwise samples.
  automatic,
  samples,
  /// Integers if they hold all values exactly; otherwise float32, or float64 if the samples are float64.
  values,
};

/// How the samples of a file become what is written.
struct WrittenNumbers {
  ValueRule rule;
  /// True: the range of values fits, so a value outside is damage. False: the range is unknown, as in a pipe.
  bool is_range_known = true;

  bool are_values() const { return !rule.changes_nothing(); }
  /// Bytes of a value; 0 if samples stay as they are.
  std::size_t value_bytes() const { return are_values() ? size_of(rule.to) : 0; }
  SampleType type(SampleType of_samples) const { return are_values() ? rule.to : of_samples; }
  /// The metadata of what is written, from that of the samples.
  Metadata metadata(const Metadata& of_samples) const;
  /// The largest error of what is written, if that of samples is `error`.
  double error_in_values(double error) const;
  /// The smallest and the largest value, if those of samples are so; nothing if each slice has a slope of its
  /// own.
  std::optional<std::array<double, 2>> range_in_values(double low, double high) const;
  /// VolumeInfo of what is written, for a volume or region that `samples` describes.
  VolumeInfo info(const VolumeInfo& samples) const;
};

/// Throws UsageError if the metadata leaves the scale of values in doubt. `of_values` is what needs it.
void require_scale(const Metadata& metadata, const Setting& of_values);

/// True if the choice below depends on the range of samples, so on the index: values may be written.
bool depends_on_range(const Format& format, Numbers wanted, const TagHeader& header);

/// The choice for a file. `index`: nullptr if it is not known yet; then all values of the type are possible.
/// Throws UsageError if values are wanted, but their scale is in doubt or not every slice has a slope.
WrittenNumbers written_numbers(const Format& format, Numbers wanted, const TagHeader& header,
                               const TagIndex* index);

/// The same for values, whatever the format. `index`: as there.
WrittenNumbers numbers_of_values(const TagHeader& header, const TagIndex* index);

/// Turns the samples of a decoded brick into what is written. Throws BrokenInput if a value is beyond the
/// range that the index says, or UsageError if the range was not known; `name` of the file begins both.
void change_brick(const WrittenNumbers& numbers, const BrickGrid& bricks, const std::string& name,
                  DecodedBrick& brick);

}  // namespace tagrid
