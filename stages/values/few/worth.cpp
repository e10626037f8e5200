#include "stages/values/few/worth.h"

#include "stages/sample/vector_code.h"

namespace tagrid {

template <class Bits>
TAGRID_VECTOR_CODE std::size_t count_unlike(const Bits* row, const Bits* above, const Bits* behind,
                                            std::size_t count) {
  std::uint32_t unlike = 0;
  for (std::size_t x = 1; x < count; ++x)
    unlike += (row[x] != row[x - 1]) & (row[x] != above[x]) & (row[x] != behind[x]);
  return unlike;
}
template std::size_t count_unlike(const std::uint8_t*, const std::uint8_t*, const std::uint8_t*, std::size_t);
template std::size_t count_unlike(const std::uint16_t*, const std::uint16_t*, const std::uint16_t*,
                                  std::size_t);
template std::size_t count_unlike(const std::uint32_t*, const std::uint32_t*, const std::uint32_t*,
                                  std::size_t);
template std::size_t count_unlike(const std::uint64_t*, const std::uint64_t*, const std::uint64_t*,
                                  std::size_t);

}  // namespace tagrid
