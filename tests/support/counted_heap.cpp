#include "tests/support/counted_heap.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "tests/support/sanitized.h"

namespace {

std::atomic<std::int64_t> in_use{0}, most{0};

}  // namespace

namespace tagrid {

HeapPeak::HeapPeak() : before_(in_use) { most = before_; }
std::uint64_t HeapPeak::bytes() const { return static_cast<std::uint64_t>(most - before_); }

}  // namespace tagrid

// Sanitizers replace these functions themselves.
#ifndef TAGRID_SANITIZED

namespace {

// The size is stored before the returned address, which has the requested alignment.
constexpr std::size_t least_alignment = alignof(std::max_align_t);

void* allocate(std::size_t size, std::size_t alignment) {
  auto* block = static_cast<std::byte*>(
      std::aligned_alloc(alignment, (size + 2 * alignment - 1) / alignment * alignment));
  if (block == nullptr) throw std::bad_alloc();
  *reinterpret_cast<std::size_t*>(block) = size;
  const std::int64_t now = in_use += static_cast<std::int64_t>(size);
  for (std::int64_t seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
  }
  return block + alignment;
}

void release(void* pointer, std::size_t alignment) {
  if (pointer == nullptr) return;
  std::byte* block = static_cast<std::byte*>(pointer) - alignment;
  in_use -= static_cast<std::int64_t>(*reinterpret_cast<std::size_t*>(block));
  std::free(block);
}

std::size_t as_number(std::align_val_t alignment) {
  return std::max(static_cast<std::size_t>(alignment), least_alignment);
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size, least_alignment); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate(size, as_number(alignment));
}
void operator delete(void* pointer) noexcept { release(pointer, least_alignment); }
void operator delete(void* pointer, std::size_t) noexcept { release(pointer, least_alignment); }
void operator delete(void* pointer, std::align_val_t alignment) noexcept {
  release(pointer, as_number(alignment));
}
void operator delete(void* pointer, std::size_t, std::align_val_t alignment) noexcept {
  release(pointer, as_number(alignment));
}

#endif
