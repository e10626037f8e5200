// The values of a node or leaf of an OpenVDB file: a byte that says what is known of the inactive ones
// (vdb::Inactive), what belongs to it, and the active ones (or all), packed.
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
  bool active_only = false;  ///< Inactive values are left out where few numbers say what they are.
  bool half = false;         ///< Floats have 16 bits.
};

/// Unpacks the values of a node of `count` entries to `values`. T is float, double or std::int32_t. Throws
/// BrokenInput unless they are as many as they should be.
template <class T, std::size_t count>
void read_vdb_values(VdbBytes& bytes, const VdbPacking& packing, const vdb::Mask<count>& active, T background,
                     T* values);

/// Goes to where they end.
template <class T, std::size_t count>
void skip_vdb_values(VdbBytes& bytes, const VdbPacking& packing, const vdb::Mask<count>& active);

/// How what tagrid writes is packed: as the library does it by default.
inline constexpr std::uint32_t vdb_packing_written = vdb::compress_blosc | vdb::compress_active;

/// Appends values, packed: the active ones of a node whose inactive ones are all the background.
template <class T>
void append_vdb_values(std::vector<std::byte>& out, const T* values, std::size_t count);

}  // namespace tagrid
