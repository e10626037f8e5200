#include "pipeline/memory/parity.h"

#include <algorithm>
#include <bit>

#include "pipeline/memory/plan.h"

namespace tagrid {
namespace {

std::uint64_t least_of_process(const ParityLayout& layout) {
  return memory_of_program + least_parity_memory(layout);
}

}  // namespace

std::uint64_t memory_for_stripes(const std::optional<std::uint64_t>& limit, const ParityLayout& layout,
                                 const std::string& work) {
  const std::uint64_t least = least_of_process(layout);
  if (!limit) {
    // The numbers of a description may be wrong.
    if (const std::uint64_t share = available_memory() / 4; share < least)
      throw MemoryLimit(work, {.needed = least, .allowed = share});
    return usual_parity_memory;
  }
  if (*limit < least) throw MemoryLimit(work, {.needed = least, .allowed = *limit});
  // Half of the rest, as the heap keeps a little of what was freed before.
  return std::min(usual_parity_memory, (*limit - least) / 2);
}

std::uint64_t least_memory_of_parity(std::uint64_t bytes, ParityShare share) {
  // Blocks become larger, and so fewer, at powers of two: below one of them, the checksums take the most.
  std::uint64_t least = 0;
  for (const std::uint64_t size : {bytes, std::bit_floor(bytes) - 1})
    if (size > 0) least = std::max(least, least_of_process(ParityLayout::of(size, share)));
  return least;
}

std::uint64_t memory_for_stripes_of_finished(const ParityLayout& layout, const Resources& resources) {
  const std::uint64_t least = least_of_process(layout);
  const std::uint64_t limit = resources.memory.value_or(least + 2 * usual_parity_memory);
  return memory_for_stripes(std::max(limit, least), layout, "making parity");
}

}  // namespace tagrid
