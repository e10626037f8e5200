// Finds out whether the values of a brick are few, and how they are then written: as numbers of 16 bits, which
// stand for values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// The first byte of the values of a brick that has few.
enum class FewKind : std::uint8_t {
  affine = 6,  ///< integers: first + step * number
  table = 7,   ///< the number of an entry; numbers that are near mean values that are near
  labels = 8,  ///< the number of an entry; numbers are equal or not
};

template <class T>
struct FewValues {
  FewKind kind = FewKind::table;
  T first{};               ///< affine: of number 0
  std::uint32_t step = 0;  ///< affine
  std::vector<T> entries;  ///< else; their keys ascend
  std::vector<std::uint16_t> numbers;
};

/// Bounds of the samples of a brick, as floats also for integers. `loose`: of most of them. `tight`: of those
/// that need it most; 0 keeps every bit.
struct FewBounds {
  double loose = 0, tight = 0;
};

/// Nothing if the values are not few, or not so few that it pays. That is found out from some samples if it is
/// clearly so. With a bound, entries stand for all values within it. Exact integers decide, for floats IEEE
/// operations, so that the result is the same on every machine. `low`, `high`: the range of the samples, if they
/// have 8 or 16 bits; not used otherwise.
template <class T>
std::optional<FewValues<T>> find_few(std::span<const T> samples, Index3 size, const FewBounds& bounds,
                                     T low = {}, T high = {});

/// The peak of the heap that find_few() takes, with its result, for samples of this many bytes.
std::uint64_t working_bytes_of_finding_few(std::uint64_t samples, std::size_t bytes);
/// What its result takes.
std::uint64_t bytes_of_few(std::uint64_t samples, std::size_t bytes);

}  // namespace tagrid
