// The pieces of a mesh that a writer program gets, in the only order that they may have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/programs/mesh_layout.h"
#include "io/programs/serve.h"
#include "io/programs/serve_writer.h"

namespace tagrid {

/// The request in a line "write-mesh". Throws UsageError if there cannot be such a mesh.
WriteMeshRequest mesh_request_of(const OrderedJson& json);

/// Entries of one array, whose bytes come next.
struct MeshPiece {
  std::size_t array = 0;  ///< in MeshLayout::arrays()
  std::int64_t first = 0, count = 0;
  std::size_t bytes = 0;
};

/// Checks what is announced, before any memory is taken for it.
class MeshEntries {
 public:
  MeshEntries() = default;
  explicit MeshEntries(const MeshLayout& mesh) : arrays_(mesh.arrays()) {}

  /// The piece that is announced. Throws UsageError if it is not the next one, or too large.
  MeshPiece next(const std::string& name, std::int64_t from, std::int64_t to, const std::string& file);
  /// Throws UsageError if entries are missing.
  void require_all(const std::string& file);

 private:
  void skip_complete();

  std::vector<MeshArray> arrays_;
  std::size_t array_ = 0;   ///< whose entries come next
  std::int64_t entry_ = 0;  ///< that comes next
};

}  // namespace tagrid
