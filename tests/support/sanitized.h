// Whether the tests run under a sanitizer, where everything takes several times as much time and memory.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace tagrid {

#ifdef TAGRID_SANITIZED
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

// Which of the bits of a small file are flipped, one after another. That checksums find them all is shown without
// sanitizers; seven has no factor in common with eight, so with them every bit of a byte has its turn as well.
inline constexpr std::size_t damage_stride = sanitized ? 7 : 1;

/// How many files a test of parity damages at random: 1,000, or 100,000 in a long run; 200 with sanitizers.
inline int damaged_files() {
  return sanitized ? 200 : std::getenv("TAGRID_LONG") != nullptr ? 100'000 : 1'000;
}

// The types of samples for which tests are repeated. Sanitizers look at lines rather than at numbers, so with them
// one type stands for those whose samples take the same way through the code.
#ifdef TAGRID_SANITIZED
using NarrowTypes = testing::Types<std::int16_t>;
using WideIntegers = testing::Types<std::int32_t>;
using WideTypes = testing::Types<std::int32_t, float, double>;
using AllTypes = testing::Types<std::int16_t, std::int32_t, float>;
#else
using NarrowTypes = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t>;
using WideIntegers = testing::Types<std::uint32_t, std::int32_t>;
using WideTypes = testing::Types<std::uint32_t, std::int32_t, float, double>;
using AllTypes = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t,
                                std::int32_t, float, double>;
#endif

}  // namespace tagrid
