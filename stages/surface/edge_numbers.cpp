#include "stages/surface/edge_numbers.h"

namespace tagrid {

void EdgeNumbers::replace_by_numbers(std::span<std::array<std::uint32_t, 3>> triangles) const {
  replace(edges_.data(), before_.data(), triangles);
}

// As vector code it counts bits by an instruction.
TAGRID_VECTOR_CODE
void EdgeNumbers::replace(const std::uint64_t* edges, const std::uint32_t* before,
                          std::span<std::array<std::uint32_t, 3>> triangles) {
  for (auto& triangle : triangles)
    for (std::uint32_t& middle : triangle) middle = number_in(edges, before, middle);
}

}  // namespace tagrid
