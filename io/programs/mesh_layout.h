// What a writer program is told about a mesh before its arrays come; docs/readers.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "stages/sample/sample_type.h"

namespace tagrid {

/// An array of a mesh: so many entries of one or several numbers.
struct MeshArray {
  std::string name;
  std::int64_t entries = 0;
  std::size_t entry_bytes = 1;

  bool operator==(const MeshArray&) const = default;
};

/// A mesh of tetrahedra.
struct MeshLayout {
  /// Arrays of samples, by their names.
  using Data = std::vector<std::pair<std::string, SampleType>>;

  std::int64_t points = 0, tetrahedra = 0;
  Data point_data, cell_data;

  /// All arrays, in the order in which they are sent: the positions of points (three float64), the connectivity of
  /// tetrahedra (four int64), and the data.
  std::vector<MeshArray> arrays() const;
};

inline constexpr const char* positions_array = "positions";
inline constexpr const char* connectivity_array = "connectivity";

/// The most bytes of an array that come with one announcement.
inline constexpr std::size_t most_bytes_of_piece = std::size_t{1} << 20;

}  // namespace tagrid
