// Writes a grid as a file, so that equal grids give equal bytes.
#pragma once

#include <cstdint>
#include <string>

#include "tools/formats/vdb/openvdb_library.h"

namespace tagrid {

/// Writes the grid to the existing file at `path`, compressed by Blosc, without inactive values. The file's identifier,
/// which the library makes at random, follows from `content` instead. Throws WorldError, which calls the file `name`.
void write_grid(const openvdb::GridBase::Ptr& grid, std::uint64_t content, const std::string& path,
                const std::string& name);

}  // namespace tagrid
