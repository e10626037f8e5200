// The part of a .tag file that decoding needs.
#pragma once

#include <memory>
#include <string>

#include "io/tag/bricks.h"
#include "tests/support/memory_source.h"

namespace tagrid {

/// Header and bricks of a .tag file with these bytes. They do not depend on where the samples came from: from which file,
/// or from a pipe. The rest of a file has the names and other bytes of the source files.
inline std::string header_and_bricks(const std::string& tag) {
  const TagBricks file(std::make_shared<MemorySource>(tag));
  return tag.substr(0, file.start(file.count()));
}

}  // namespace tagrid
