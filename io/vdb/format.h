// The layout of OpenVDB files, as far as tagrid reads and writes it: file versions 222 to 224, which all
// releases since 2.2 write, and trees of the usual shape (nodes of 32^3 and 16^3 below a root, leaves of
// 8^3). Numbers are little endian. A file consists of
//
//   magic (8 bytes), file version, major and minor version of the library (u32 each), 1 if there are
//   positions (u8), a UUID (36 characters); metadata of the file; the number of grids (i32); the grids
//
// and a grid consists of
//
//   its unique name, its type, the name of the grid whose tree it shares or "" (strings); where it begins,
//   where its buffers begin, where it ends (i64 each); how values are compressed (u32); its metadata; its
//   transform (the name of a map, its numbers); the tree, without the values of leaves (the topology); the
//   buffers of the leaves
//
// A string is its length (u32) and its characters. Metadata begin with their number (u32). Each has its name,
// the name of its type, the number of bytes of its value (u32), and these bytes. Nodes come depth first. A
// node begins with its masks: which entries are children, and which of the others are active. Its values
// follow; see io/vdb/values.h. The entry of (x, y, z) has the number (x * n + y) * n + z: here z is fastest.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace tagrid::vdb {

inline constexpr std::string_view magic = {" BDV\0\0\0\0", 8};
inline constexpr std::uint64_t magic_number = 0x56444220;  // the same
inline constexpr std::uint32_t oldest_version = 222, newest_version = 224;
inline constexpr std::size_t uuid_bytes = 36;
/// No name of a grid, a type or a map is longer, in bytes.
inline constexpr std::size_t longest_name = 4096;
/// Separates the name of a grid from a number, if several grids have the same name.
inline constexpr char name_separator = '\x1e';
inline constexpr std::string_view half_suffix = "_HalfFloat";

/// Bits of the number that says how the values of a grid are compressed.
inline constexpr std::uint32_t compress_zip = 1, compress_active = 2, compress_blosc = 4;

/// How a node describes its inactive values.
enum class Inactive : std::uint8_t {
  background,            ///< all are the background
  minus_background,      ///< all are its negative
  one_value,             ///< all are the value that follows
  background_and_minus,  ///< a mask selects the background, or its negative
  background_and_value,  ///< a mask selects the background, or the value that follows
  two_values,            ///< a mask selects one of the two values that follow; where it is set, the second
  stored,                ///< all are stored, beside the active ones
};

/// Binary logarithms of the voxels along an edge: of a leaf, and of the two kinds of nodes above it.
inline constexpr int leaf_log = 3, lower_log = 7, upper_log = 12;
inline constexpr std::int64_t leaf_edge = 1 << leaf_log, lower_edge = 1 << lower_log,
                              upper_edge = 1 << upper_log;
inline constexpr std::size_t leaf_values = 512, lower_values = 4096, upper_values = 32768;

/// The number of an entry, with `log` bits for each axis.
constexpr std::size_t entry(std::int64_t x, std::int64_t y, std::int64_t z, int log) {
  return static_cast<std::size_t>((x << (2 * log)) | (y << log) | z);
}

template <std::size_t count>
struct Mask {
  std::array<std::uint8_t, count / 8> bits = {};

  bool test(std::size_t i) const { return (bits[i / 8] >> (i % 8) & 1) != 0; }
  void set(std::size_t i) { bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | 1u << (i % 8)); }
  std::size_t set_count() const {
    std::size_t sum = 0;
    for (const std::uint8_t byte : bits) sum += static_cast<std::size_t>(std::popcount(byte));
    return sum;
  }
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(bits)); }
};

/// The name of the type of a grid with samples of type T; T is float, double or std::int32_t.
template <class T>
constexpr std::string_view grid_type() {
  if constexpr (sizeof(T) == 8) return "Tree_double_5_4_3";
  if constexpr (T(0.5) != 0) return "Tree_float_5_4_3";
  return "Tree_int32_5_4_3";
}

/// tagrid's own metadata: the type and the number of samples, the lines of the NRRD header, the largest
/// error.
inline constexpr std::string_view type_key = "tagrid_type", dims_key = "tagrid_dims",
                                  fields_key = "tagrid_nrrd_fields", error_key = "tagrid_max_error";

}  // namespace tagrid::vdb
