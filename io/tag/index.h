// The index of a .tag file: statistics of every brick and of the volume. docs/format.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/tag/members.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/statistics.h"
#include "stages/sample/status.h"

namespace tagrid {

struct IndexEntry {
  std::uint32_t activity_bytes = 0;
  std::uint32_t value_bytes = 0;
  double low = 0, high = 0, mean = 0;  ///< of the brick's finite original samples
};

struct TagIndex {
  std::vector<IndexEntry> bricks;
  Statistics total;
  std::vector<Member> members;  ///< in the order of the file

  void add(std::size_t activity_bytes, std::size_t value_bytes, const Statistics& brick);
};

/// The form of an index: which fields it has.
struct IndexForm {
  int levels = 0;       ///< whose active points are counted: none if the file stores no grid
  bool floats = false;  ///< the volume has floats, whose sum of squared errors is a float
  bool mesh = false;    ///< the mesh of the file has a bound, so its error is recorded
};
IndexForm index_form(const CodingParameters& parameters);

/// The fields of the index up to the table of members, not yet compressed.
std::vector<std::byte> serialize_index(const TagIndex& index, const IndexForm& form);

/// Reads these fields. `bricks` and `form` are those of the header; any other size is broken.
Status parse_index(std::span<const std::byte> bytes, std::uint64_t bricks, const IndexForm& form,
                   TagIndex& index);

/// Bytes of these fields.
std::uint64_t index_size(std::uint64_t bricks, const IndexForm& form);

}  // namespace tagrid
