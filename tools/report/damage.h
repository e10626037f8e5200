// What to do about a damaged .tag file, and which of its parts are lost, in words.
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/byte_source.h"
#include "stages/grid/brick_grid.h"

namespace tagrid {

/// True if the first bytes of a file are those of a .tag file, of any version.
bool file_begins_as_tag(const ByteSource& file);

/// The message of an error of a .tag file. Where a file begins like no .tag file, but ends like one or has
/// parity, it says that the beginning is damaged.
std::string words_of_damage(const std::string& input, const BrokenInput& broken);

/// A path as it is written in a command of a shell: 'my scan.tag', in quotes only if it needs them. Those of
/// Windows are double.
std::string word_of_command(std::string_view path);

/// "tagrid repair scan.tag -o OUT".
std::string repair_command(const std::string& input);

/// The same, and how to repair a file that has parity.
std::string words_with_repair(const std::string& input, const BrokenInput& broken);

/// "; tagrid decode scan.tag --salvage decodes the intact bricks", of the volume with this number, or of the first
/// one that has any. Empty for an intact file, and if nothing can be decoded. Reads the entire file.
std::string salvage_advice(const std::string& input, std::optional<std::int64_t> volume = std::nullopt);

/// words_with_repair() and salvage_advice(). Finds parity also if the end of the file is damaged.
std::string words_with_salvage(const std::string& input, const BrokenInput& broken,
                               std::optional<std::int64_t> volume);

/// Does `work`, which reads a .tag file. Errors of damage have the words above.
template <class Work>
void with_repair_advice(const std::string& input, Work work) {
  try {
    work();
  } catch (const BrokenInput& broken) {
    throw BrokenInput(words_with_repair(input, broken));
  }
}

/// A line for each run of bricks: their numbers, and their samples as a --region. Long lists are cut.
std::vector<std::string> lines_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks);

/// A list of boxes of samples: [{"low": [x0, y0, z0], "high": [x1, y1, z1]}, ...], half open as --region is.
nlohmann::ordered_json json_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks);

/// "3 of 192 bricks are lost".
std::string count_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks);

}  // namespace tagrid
