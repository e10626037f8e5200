// What the index of an archive keeps of a .tag file.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tools/archive/subject.h"

namespace tagrid {

/// What people search for, and all else that `tagrid archive list --json` shows of the content of a file.
struct FileFacts {
  Subject subject;
  std::string type;
  std::optional<double> bound;  ///< the largest error of samples that is allowed; nothing: any
  std::uint64_t voxels = 0;     ///< of all volumes
  std::uint64_t raw_bytes = 0;  ///< of their samples
  nlohmann::ordered_json more;  ///< dims, type, geometry, errors, and key-value pairs
};

/// Reads the header and the end of a file. Throws BrokenInput and WorldError.
FileFacts facts_of(const std::string& path);

/// The message of an error without the path of the file, where the file is named anyway.
std::string without_path(std::string message, const std::string& path);

}  // namespace tagrid
