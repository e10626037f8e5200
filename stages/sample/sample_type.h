// The sample types of a volume, in one place: everything that depends on the type asks here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <type_traits>

namespace tagrid {

/// Numbers are part of the file format: never renumber.
enum class SampleType : std::uint8_t {
  uint8 = 1,
  int8 = 2,
  uint16 = 3,
  int16 = 4,
  uint32 = 5,
  int32 = 6,
  float32 = 7,
  float64 = 8,
};

inline constexpr std::array<SampleType, 8> all_sample_types = {
    SampleType::uint8,  SampleType::int8,  SampleType::uint16,  SampleType::int16,
    SampleType::uint32, SampleType::int32, SampleType::float32, SampleType::float64};

/// Applies M(T) to every C++ type of samples. The narrow types have all their values in 16 bits; the others
/// are wide, and coded differently. Explicit instantiations are made with these lists, so that no type is
/// forgotten.
#define TAGRID_FOR_EACH_NARROW_TYPE(M) M(std::uint8_t) M(std::int8_t) M(std::uint16_t) M(std::int16_t)
#define TAGRID_FOR_EACH_WIDE_TYPE(M) M(std::uint32_t) M(std::int32_t) M(float) M(double)
#define TAGRID_FOR_EACH_TYPE(M) TAGRID_FOR_EACH_NARROW_TYPE(M) TAGRID_FOR_EACH_WIDE_TYPE(M)

template <class T>
inline constexpr bool is_wide = sizeof(T) >= 4;

/// True if a number, read from a file, is that of a sample type.
constexpr bool is_sample_type(SampleType type) {
  return type >= SampleType::uint8 && type <= SampleType::float64;
}

constexpr bool is_wide_type(SampleType type) { return type >= SampleType::uint32; }
constexpr bool is_float_type(SampleType type) { return type >= SampleType::float32; }

/// 0 if it is no sample type.
constexpr std::size_t size_of(SampleType type) {
  constexpr std::array<std::size_t, 8> sizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return is_sample_type(type) ? sizes[static_cast<std::size_t>(type) - 1] : 0;
}

constexpr std::string_view name_of(SampleType type) {
  constexpr std::array<std::string_view, 8> names = {"uint8",  "int8",  "uint16",  "int16",
                                                     "uint32", "int32", "float32", "float64"};
  return is_sample_type(type) ? names[static_cast<std::size_t>(type) - 1] : "unknown";
}

constexpr std::optional<SampleType> sample_type_named(std::string_view name) {
  for (SampleType type : all_sample_types)
    if (name_of(type) == name) return type;
  return std::nullopt;
}

/// The SampleType of the C++ type T.
template <class T>
constexpr SampleType sample_type_of() {
  if constexpr (std::is_same_v<T, std::uint8_t>) return SampleType::uint8;
  if constexpr (std::is_same_v<T, std::int8_t>) return SampleType::int8;
  if constexpr (std::is_same_v<T, std::uint16_t>) return SampleType::uint16;
  if constexpr (std::is_same_v<T, std::int16_t>) return SampleType::int16;
  if constexpr (std::is_same_v<T, std::uint32_t>) return SampleType::uint32;
  if constexpr (std::is_same_v<T, std::int32_t>) return SampleType::int32;
  if constexpr (std::is_same_v<T, float>) return SampleType::float32;
  if constexpr (std::is_same_v<T, double>) return SampleType::float64;
}

/// Calls `f(T{})` with the C++ type T of a sample type, and returns its result.
template <class F>
decltype(auto) with_sample_type(SampleType type, F&& f) {
#define TAGRID_CASE(T)      \
  case sample_type_of<T>(): \
    return f(T{});
  switch (type) { TAGRID_FOR_EACH_TYPE(TAGRID_CASE) }
#undef TAGRID_CASE
  throw std::logic_error("with_sample_type: no sample type");
}

}  // namespace tagrid
