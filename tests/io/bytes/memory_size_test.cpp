// A size of 64 bits does not become a smaller one where memory has 32.
#include "io/bytes/memory_size.h"

#include <gtest/gtest.h>

#include "io/errors/error_kinds.h"

namespace tagrid {
namespace {

TEST(MemorySize, IsTheSameNumberOrRefused) {
  EXPECT_EQ(memory_size<std::uint32_t>(0), 0U);
  EXPECT_EQ(memory_size<std::uint32_t>(0xFFFFFFFFU), 0xFFFFFFFFU);
  for (const std::uint64_t size : {std::uint64_t{1} << 32, (std::uint64_t{1} << 32) + 24, ~std::uint64_t{0}})
    EXPECT_THROW(memory_size<std::uint32_t>(size), std::length_error) << size;
  EXPECT_EQ(memory_size(std::uint64_t{5} << 40), std::size_t{5} << 40);
}

TEST(MemorySize, ThatIsRefusedIsALackOfMemory) {
  try {
    memory_size<std::uint32_t>(std::uint64_t{1} << 32);
  } catch (...) {
    EXPECT_EQ(sorted_error(std::current_exception()).kind, ErrorKind::memory);
  }
}

}  // namespace
}  // namespace tagrid
