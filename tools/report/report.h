// Reports on a .tag file, for people and for scripts.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/run/run.h"

namespace tagrid {

/// One line on an encoding: size, ratio, bits per voxel, largest error.
std::string summary(const EncodeResult& result);
/// One line on a decoding: sizes, ratio, largest error.
std::string summary(const DecodeResult& result);

/// One line on memory: the planned and the used amount, and how often samples were read, if that matters.
std::string memory_summary(std::uint64_t planned, std::optional<double> times_read = std::nullopt);

/// The settings of the encoder and the errors that it achieved: parts of `info --json` and --json.
nlohmann::ordered_json settings_json(const CodingParameters& parameters);
nlohmann::ordered_json achieved_json(const TagHeader& header, const TagIndex& index);

/// An error of samples: "2", "2 HU", "2 in stored samples (5 HU)", as the volume says what samples mean.
std::string error_text(double error, const TagHeader& header);

/// "space left-posterior-superior, in mm": in which coordinates a mesh or a surface lies.
std::string coordinates_text(const TagHeader& header);
/// True if the slices of the source lie at unequal distances.
bool has_uneven_slices(const TagHeader& header);

/// The object of `info --json`. `with_levels`: the active points in the index are those of the grid;
/// otherwise they are not known. Throws BrokenInput if the beginning of the envelope is wrong.
nlohmann::ordered_json info_json(const TagSummary& file, bool with_levels = true);

/// The same for people, with the table of levels if these are known.
std::string info_text(const TagSummary& file, bool with_levels = true);

/// `bytes` as text that JSON can hold, as file names may contain any bytes; null if there are none.
nlohmann::ordered_json json_text_or_null(const std::string& bytes);

}  // namespace tagrid
