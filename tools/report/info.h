// What `tagrid info` prints about a .tag file, for people and for scripts; reports have parts of it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "io/tag/bricks.h"

namespace tagrid {

/// The settings of the encoder and the errors that it achieved: parts of `info --json` and --json.
nlohmann::ordered_json settings_json(const CodingParameters& parameters);
nlohmann::ordered_json achieved_json(const TagHeader& header, const Statistics& total);

/// What a file contains, in short: its size, type, place, errors and key-value pairs. A part of the object below.
nlohmann::ordered_json contents_json(const TagHeader& header, const Statistics& total);

/// The object of `info --json`. `with_levels`: the active points in the index are those of the grid;
/// otherwise they are not known. Throws BrokenInput if the beginning of the envelope is wrong.
nlohmann::ordered_json info_json(const TagSummary& file, bool with_levels = true);

/// The same for people, with the table of levels if these are known.
std::string info_text(const TagSummary& file, bool with_levels = true);

}  // namespace tagrid
