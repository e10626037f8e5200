// The meaning of samples, as key-value pairs of NRRD header lines give it, and doubts about it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// The slope, intercept and units of the values: those that add_rescale() wrote. If there are none, if they
/// are not finite numbers, or if each slice has its own, values are the samples. Throws BrokenInput if a line
/// is not one of a header.
Rescale rescale_of(std::string_view nrrd_fields);

/// True if each slice has a slope of its own (slice_slopes). Throws as above.
bool has_slopes_of_slices(std::string_view nrrd_fields);

/// The slope with which an error of values becomes the error of samples that is safe for all slices: that of
/// rescale_of() or the largest of slice_slopes. Throws as above.
double largest_slope(std::string_view nrrd_fields);

/// The slope and intercept with which bounds on values become bounds on samples: those of rescale_of(), or
/// the largest slope and no intercept if each slice has its own. Throws as above.
Rescale rescale_of_bounds(std::string_view nrrd_fields);

/// A sentence without a full stop if a slope or an intercept, of all slices or of each of `slices`, is
/// present and unreadable: the values of samples are then unknown. "" otherwise. Throws as above.
std::string doubt_of_rescale(std::string_view nrrd_fields, std::int64_t slices);

/// The slope and intercept of each slice.
struct RescaleOfSlices {
  std::vector<double> slopes, intercepts;
};

/// Those of slice_slopes and slice_intercepts; nothing if they are not finite numbers, one for each of
/// `slices`. Throws as above.
std::optional<RescaleOfSlices> rescale_of_slices(std::string_view nrrd_fields, std::int64_t slices);

/// The keys of the factor and the offset that turned stored samples into the values in a file. If each slice
/// has its own, the keys begin with "slice_".
inline constexpr std::string_view applied_slope_key = "applied_slope",
                                  applied_intercept_key = "applied_intercept";

/// The header lines of a volume whose samples were converted to values. Slopes and intercepts become pairs
/// that record the conversion ("applied_intercept"). Lines about single samples (min, max) are removed; a
/// background becomes a value. Throws as above.
std::string fields_of_values(std::string_view nrrd_fields);

/// The largest error of samples that is at most `error` in values.
double error_in_samples(double error, const Rescale& rescale);

/// The keys of SourceFacts::scale_doubt and SourceFacts::not_understood. Sentences of the latter are joined
/// by "; ".
inline constexpr std::string_view scale_doubt_key = "scale doubt", not_understood_key = "not understood";

/// Header lines for the doubts in `facts` that its header does not have yet. `names` are those of the source
/// that begin sentences: they are left out, since a file may be called otherwise later.
std::string lines_of_doubts(const SourceFacts& facts, const std::vector<std::string>& names);

/// Why it is unknown how values follow from samples, according to header lines; "" if it is known.
std::string scale_doubt_in(std::string_view nrrd_fields);

/// All doubts in header lines, for users: that of the scale first.
std::vector<std::string> doubts_in(std::string_view nrrd_fields);

}  // namespace tagrid
