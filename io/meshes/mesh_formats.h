// The formats of meshes, as a table.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "io/meshes/mesh_file.h"

namespace tagrid {

struct MeshFormat {
  std::string_view name;
  std::array<std::string_view, 2> extensions;  ///< the second may be empty
  std::unique_ptr<MeshFile> (*create)(const std::string& path, SampleType value_type, bool overwrite);
  /// The program tagrid-write-WRITER writes it, with up to so many bytes of memory; "" if tagrid does so itself.
  std::string_view writer = "";
  std::uint64_t memory_of_writer = 0;
};

std::span<const MeshFormat> mesh_formats();

/// The format that the name of a file says; VTU for "-". Throws UsageError if it says none.
const MeshFormat& mesh_format_of(const std::string& path);

}  // namespace tagrid
