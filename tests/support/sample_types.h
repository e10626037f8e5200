// The types of samples for which tests are repeated. Sanitizers look at lines rather than at numbers, so with them
// one type stands for those whose samples take the same way through the code.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>

namespace tagrid {

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
