// The meaning of samples, as key-value pairs of a description give it, and doubts about it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/metadata/metadata.h"

namespace tagrid {

/// Adds what samples mean, if they are not the values themselves: rescale_slope, rescale_intercept,
/// rescale_units.
void add_rescale(const Rescale& rescale, KeyValues& pairs);

/// A sentence without a full stop if a slope or an intercept, of all slices or of each of `slices`, is
/// present and unreadable: the values of samples are then unknown. "" otherwise.
std::string doubt_of_rescale(const Metadata& metadata, std::int64_t slices);

/// The slope and intercept of each slice.
struct RescaleOfSlices {
  std::vector<double> slopes, intercepts;
};

/// Those of slice_slopes and slice_intercepts; nothing if they are not finite numbers, one for each of
/// `slices`.
std::optional<RescaleOfSlices> rescale_of_slices(const Metadata& metadata, std::int64_t slices);

/// The keys of the factor and the offset that turned stored samples into the values in a file. If each slice
/// has its own, the keys begin with "slice_".
inline constexpr std::string_view applied_slope_key = "applied_slope",
                                  applied_intercept_key = "applied_intercept";

/// The description of a volume whose samples were converted to values. Slopes and intercepts become pairs that
/// record the conversion ("applied_intercept"). Entries about single samples (min, max) are removed; a
/// background becomes a value.
Metadata metadata_of_values(const Metadata& metadata);

/// The largest error of samples that is at most `error` in values.
double error_in_samples(double error, const Rescale& rescale);

/// The keys of SourceFacts::scale_doubt and SourceFacts::not_understood. Sentences of the latter are joined
/// by "; ".
inline constexpr std::string_view scale_doubt_key = "scale doubt", not_understood_key = "not understood";

/// What sentences on a source may call it.
struct NamesOfSource {
  std::vector<std::string> names;    ///< that begin sentences
  std::vector<std::string> folders;  ///< of its files, and those above; the longest first
  std::vector<std::string> files;    ///< without directories; the longest first
};
/// `names`: see NamesOfSource. `files`: paths.
NamesOfSource names_of_source(const std::vector<std::string>& names, const std::vector<std::string>& files);

/// Records these doubts, if the description does not record any yet. Names of the source are left out: files may be
/// called otherwise later, and paths often name patients.
void add_doubts(const std::string& scale_doubt, const std::vector<std::string>& not_understood,
                const NamesOfSource& names, Metadata& metadata);

/// Why it is unknown how values follow from samples, according to the description; "" if it is known.
std::string scale_doubt_in(const Metadata& metadata);

/// All doubts in the description, for users: that of the scale first.
std::vector<std::string> doubts_in(const Metadata& metadata);

}  // namespace tagrid
