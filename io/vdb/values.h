// The values of a node or leaf of an OpenVDB file: a byte that describes the inactive ones (vdb::Inactive),
// the values that belong to this byte, and the packed active values (or all values).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/vdb/bytes.h"
#include "io/vdb/format.h"

namespace tagrid {

/// How the values of a grid are stored.
struct VdbPacking {
  bool zip = false, blosc = false;
  bool active_only = false;  ///< Inactive values are left out if a few numbers describe them.
  bool half = false;         ///< Floats are stored in 16 bits.
};

/// Unpacks the values of a node of `count` entries to `values`. T is float, double or std::int32_t. Throws
/// BrokenInput if their number is wrong.
template <class T, std::size_t count>
void read_vdb_values(VdbBytes& bytes, const VdbPacking& packing, const vdb::Mask<count>& active, T background,
                     T* values);

/// Skips values that are stored in this way.
template <class T, std::size_t count>
void skip_vdb_values(VdbBytes& bytes, const VdbPacking& packing, const vdb::Mask<count>& active);

/// The packing of the files that tagrid writes, which is the library's default.
inline constexpr std::uint32_t vdb_packing_written = vdb::compress_blosc | vdb::compress_active;

/// Appends packed values: the active ones of a node whose inactive ones are all the background.
template <class T>
void append_vdb_values(std::vector<std::byte>& out, const T* values, std::size_t count);

}  // namespace tagrid
