// Little-endian numbers in bytes. No other file knows the layout of numbers in files.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace tagrid {

/// The bytes of `value` in the opposite order.
template <class T>
constexpr T byte_swapped(T value) {
  static_assert(std::is_unsigned_v<T>);
  if constexpr (sizeof(T) == 1)
    return value;
  else if constexpr (sizeof(T) == 2)
    return static_cast<T>(__builtin_bswap16(value));
  else if constexpr (sizeof(T) == 4)
    return __builtin_bswap32(value);
  else
    return __builtin_bswap64(value);
}

namespace little_endian_detail {
template <std::size_t size>
using Bits =
    std::conditional_t<size == 1, std::uint8_t,
                       std::conditional_t<size == 2, std::uint16_t,
                                          std::conditional_t<size == 4, std::uint32_t, std::uint64_t>>>;
}  // namespace little_endian_detail

/// The number of type T (an integer, float or double) in the sizeof(T) bytes at `from`, of any alignment.
template <class T>
T load_little_endian(const std::byte* from) {
  static_assert(std::is_arithmetic_v<T> && sizeof(T) <= 8);
  little_endian_detail::Bits<sizeof(T)> bits;
  std::memcpy(&bits, from, sizeof bits);
  if constexpr (std::endian::native == std::endian::big) bits = byte_swapped(bits);
  return std::bit_cast<T>(bits);
}

/// Stores `value` in the sizeof(T) bytes at `to`, of any alignment.
template <class T>
void store_little_endian(std::byte* to, T value) {
  static_assert(std::is_arithmetic_v<T> && sizeof(T) <= 8);
  auto bits = std::bit_cast<little_endian_detail::Bits<sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) bits = byte_swapped(bits);
  std::memcpy(to, &bits, sizeof bits);
}

/// Reverses the bytes of each of the `count` samples of `sample_size` (1, 2, 4 or 8) bytes at `samples`.
inline void swap_bytes_of_samples(std::byte* samples, std::size_t count, std::size_t sample_size) {
  const auto swap_all = [&]<class T>(T) {
    for (std::size_t i = 0; i < count; ++i) {
      T bits;
      std::memcpy(&bits, samples + i * sizeof(T), sizeof(T));
      bits = byte_swapped(bits);
      std::memcpy(samples + i * sizeof(T), &bits, sizeof(T));
    }
  };
  if (sample_size == 2) swap_all(std::uint16_t{});
  if (sample_size == 4) swap_all(std::uint32_t{});
  if (sample_size == 8) swap_all(std::uint64_t{});
}

/// Turns samples from the byte order of a file into that of the machine, or back.
inline void swap_if_not_native(std::byte* samples, std::size_t count, std::size_t sample_size,
                               bool big_endian) {
  if (big_endian != (std::endian::native == std::endian::big))
    swap_bytes_of_samples(samples, count, sample_size);
}

/// `samples` of `sample_size` bytes as little endian: the samples themselves, or a copy in `swapped`.
inline std::span<const std::byte> little_endian_samples(std::span<const std::byte> samples,
                                                        std::size_t sample_size,
                                                        std::vector<std::byte>& swapped) {
  if constexpr (std::endian::native == std::endian::little) return samples;
  swapped.assign(samples.begin(), samples.end());
  swap_bytes_of_samples(swapped.data(), swapped.size() / sample_size, sample_size);
  return swapped;
}

class FieldWriter {
 public:
  template <class T>
  void put(T value) {
    std::array<std::byte, sizeof(T)> field;
    store_little_endian(field.data(), value);
    for (const std::byte byte : field) bytes_.push_back(byte);
  }
  /// field() of a writer and of a reader lets one function list the fields of both.
  template <class T>
  void field(const T& value) {
    put(value);
  }
  /// A number or an enumerator that is stored as another type.
  template <class T, class Stored>
  void field(const T& value, Stored) {
    put(static_cast<Stored>(value));
  }
  void put_bytes(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte>& bytes() { return bytes_; }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads what FieldWriter wrote. Past the end it returns zeros, and complete() is false.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  T get() {
    if (sizeof(T) > left()) {
      overrun_ = true;
      position_ = bytes_.size();
      return T{};
    }
    position_ += sizeof(T);
    return load_little_endian<T>(bytes_.data() + position_ - sizeof(T));
  }
  template <class T>
  void field(T& value) {
    value = get<T>();
  }
  /// A stored number that T does not hold becomes its largest one.
  template <class T, class Stored>
  void field(T& value, Stored) {
    using Number =
        typename std::conditional_t<std::is_enum_v<T>, std::underlying_type<T>, std::type_identity<T>>::type;
    const auto stored = get<Stored>();
    value = static_cast<T>(std::in_range<Number>(stored) ? static_cast<Number>(stored)
                                                         : std::numeric_limits<Number>::max());
  }
  std::span<const std::byte> get_bytes(std::size_t size) {
    if (size > left()) {
      overrun_ = true;
      position_ = bytes_.size();
      return {};
    }
    position_ += size;
    return bytes_.subspan(position_ - size, size);
  }
  std::size_t left() const { return bytes_.size() - position_; }
  /// True if exactly all bytes were read.
  bool complete() const { return !overrun_ && left() == 0; }
  bool overrun() const { return overrun_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  bool overrun_ = false;
};

/// A number of 128 bits as two fields, the low half first.
inline void field_128(FieldWriter& fields, const unsigned __int128& value) {
  fields.put(static_cast<std::uint64_t>(value));
  fields.put(static_cast<std::uint64_t>(value >> 64));
}
inline void field_128(FieldReader& fields, unsigned __int128& value) {
  const auto low_half = fields.get<std::uint64_t>(), high_half = fields.get<std::uint64_t>();
  value = static_cast<unsigned __int128>(high_half) << 64 | low_half;
}

}  // namespace tagrid
