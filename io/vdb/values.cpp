#include "io/vdb/values.h"

#include <blosc.h>
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <type_traits>

#include "io/bytes/little_endian.h"

namespace tagrid {
namespace {

using vdb::Inactive;
using vdb::Mask;

template <class T>
T negative(T value) {
  if constexpr (std::is_integral_v<T>)
    return static_cast<T>(std::uint32_t{0} - static_cast<std::uint32_t>(value));
  else
    return -value;
}

/// Converts an IEEE 754 number of 16 bits.
float float_of_half(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16, exponent = half >> 10 & 31u, fraction = half & 1023u;
  if (exponent == 31) return std::bit_cast<float>(sign | 0x7f800000u | fraction << 13);
  const float size = exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                   : std::bit_cast<float>((exponent + 112) << 23 | fraction << 13);
  return sign != 0 ? -size : size;
}

/// The description of inactive values, before the packed values.
template <class T, std::size_t count>
struct Head {
  T inactive[2];  ///< `second` tells which of them an inactive value is
  Mask<count> second;
  std::size_t stored = count;
};

template <class T, std::size_t count>
Head<T, count> read_head(VdbBytes& bytes, const VdbPacking& packing, const Mask<count>& active,
                         T background) {
  const auto kind = static_cast<Inactive>(bytes.number<std::uint8_t>());
  if (kind > Inactive::stored) bytes.fail("inactive values are stored in an unknown way");
  Head<T, count> head;
  head.inactive[0] = kind == Inactive::background ? background : negative(background);
  head.inactive[1] = background;
  if (kind == Inactive::one_value || kind == Inactive::background_and_value || kind == Inactive::two_values)
    head.inactive[0] = bytes.number<T>();
  if (kind == Inactive::two_values) head.inactive[1] = bytes.number<T>();
  if (kind == Inactive::background_and_minus || kind == Inactive::background_and_value ||
      kind == Inactive::two_values)
    std::memcpy(head.second.bits.data(), bytes.take(count / 8), count / 8);
  if (packing.active_only && kind != Inactive::stored) head.stored = active.set_count();
  return head;
}

/// The packed size of `size` bytes: positive if they are compressed.
std::int64_t read_packed_size(VdbBytes& bytes, std::size_t size) {
  const auto packed = bytes.number<std::int64_t>();
  const auto largest = static_cast<std::int64_t>(size) + BLOSC_MAX_OVERHEAD;
  if (packed > largest || (packed <= 0 && packed != -static_cast<std::int64_t>(size)))
    bytes.fail(
        fmt::format("{} bytes of values have an impossible compressed size of {} bytes", size, packed));
  return packed;
}

bool unpack_blosc(const std::byte* from, std::size_t packed, void* to, std::size_t size) {
  std::size_t unpacked = 0;
  if (blosc_cbuffer_validate(from, packed, &unpacked) != 0 || unpacked != size) return false;
  return size == 0 || blosc_decompress_ctx(from, to, size, 1) == static_cast<int>(size);
}

bool unpack_zip(const std::byte* from, std::size_t packed, void* to, std::size_t size) {
  uLongf unpacked = size;
  const int result =
      uncompress(static_cast<Bytef*>(to), &unpacked, reinterpret_cast<const Bytef*>(from), packed);
  if (result == Z_MEM_ERROR) throw std::bad_alloc();
  return result == Z_OK && unpacked == size;
}

/// Unpacks the next `size` bytes of values to `to`.
void unpack(VdbBytes& bytes, const VdbPacking& packing, void* to, std::size_t size) {
  if (packing.blosc || packing.zip) {
    const std::int64_t packed = read_packed_size(bytes, size);
    if (packed > 0) {
      const auto count = static_cast<std::size_t>(packed);
      const std::byte* from = bytes.take(count);
      if (!(packing.blosc ? unpack_blosc(from, count, to, size) : unpack_zip(from, count, to, size)))
        bytes.fail("compressed values are damaged");
      return;
    }
  }
  if (size > 0) std::memcpy(to, bytes.take(size), size);
}

template <class T>
std::size_t stored_size(const VdbPacking& packing) {
  return packing.half && !std::is_integral_v<T> ? 2 : sizeof(T);
}

/// True if a node with `stored` values has a packed block. In a file of half floats, a node without stored values
/// has none.
bool has_values(const VdbPacking& packing, std::size_t stored) { return !packing.half || stored > 0; }

}  // namespace

template <class T, std::size_t count>
void read_vdb_values(VdbBytes& bytes, const VdbPacking& packing, const Mask<count>& active, T background,
                     T* values) {
  const Head<T, count> head = read_head(bytes, packing, active, background);
  std::vector<std::byte> unpacked(head.stored * stored_size<T>(packing));
  if (has_values(packing, head.stored)) unpack(bytes, packing, unpacked.data(), unpacked.size());
  const std::byte* next = unpacked.data();
  for (std::size_t i = 0; i < count; ++i) {
    if (head.stored != count && !active.test(i)) {
      values[i] = head.inactive[head.second.test(i)];
    } else if (stored_size<T>(packing) == 2) {
      values[i] = static_cast<T>(float_of_half(load_little_endian<std::uint16_t>(next)));
      next += 2;
    } else {
      values[i] = load_little_endian<T>(next);
      next += sizeof(T);
    }
  }
}

template <class T, std::size_t count>
void skip_vdb_values(VdbBytes& bytes, const VdbPacking& packing, const Mask<count>& active) {
  const std::size_t stored = read_head(bytes, packing, active, T{}).stored;
  if (!has_values(packing, stored)) return;
  const std::size_t size = stored * stored_size<T>(packing);
  const std::int64_t packed = packing.blosc || packing.zip ? read_packed_size(bytes, size) : 0;
  bytes.skip(packed > 0 ? static_cast<std::size_t>(packed) : size);
}

template <class T>
void append_vdb_values(std::vector<std::byte>& out, const T* values, std::size_t count) {
  std::vector<std::byte> plain(count * sizeof(T));
  for (std::size_t i = 0; i < count; ++i) store_little_endian(plain.data() + i * sizeof(T), values[i]);
  std::vector<std::byte> packed(plain.size() + BLOSC_MAX_OVERHEAD);
  // The library uses the same parameters.
  const int size =
      plain.empty() ? 0
                    : blosc_compress_ctx(9, BLOSC_SHUFFLE, sizeof(float), plain.size(), plain.data(),
                                         packed.data(), packed.size(), BLOSC_LZ4_COMPNAME, plain.size(), 1);
  const bool smaller = size > 0 && static_cast<std::size_t>(size) < plain.size();
  std::vector<std::byte>& chosen = smaller ? packed : plain;
  if (smaller) packed.resize(static_cast<std::size_t>(size));
  const auto stored = static_cast<std::int64_t>(chosen.size());
  std::byte head[8];
  store_little_endian(head, smaller ? stored : -stored);
  out.insert(out.end(), head, head + 8);
  out.insert(out.end(), chosen.begin(), chosen.end());
}

#define TAGRID_VDB_NODE(T, count)                                                         \
  template void read_vdb_values(VdbBytes&, const VdbPacking&, const Mask<count>&, T, T*); \
  template void skip_vdb_values<T>(VdbBytes&, const VdbPacking&, const Mask<count>&);
#define TAGRID_VDB_VALUES(T)            \
  TAGRID_VDB_NODE(T, vdb::leaf_values)  \
  TAGRID_VDB_NODE(T, vdb::lower_values) \
  TAGRID_VDB_NODE(T, vdb::upper_values) \
  template void append_vdb_values(std::vector<std::byte>&, const T*, std::size_t);
TAGRID_VDB_VALUES(float)
TAGRID_VDB_VALUES(double)
TAGRID_VDB_VALUES(std::int32_t)

}  // namespace tagrid
