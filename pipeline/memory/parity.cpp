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
  if (!limit) return usual_parity_memory;
  const std::uint64_t least = least_of_process(layout);
  if (*limit < least) throw MemoryLimit(work, *limit, least, {});
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
  const auto limit = resources.memory ? std::optional(std::max(*resources.memory, least)) : std::nullopt;
  return memory_for_stripes(limit, layout, "making parity");
}

}  // namespace tagrid
