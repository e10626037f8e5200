#include "stages/values/wavefront/buffers.h"

namespace tagrid {
namespace {

constexpr std::size_t cache_line = 64;

/// Hands out parts of a block; without a block, it only adds up their sizes.
class Parts {
 public:
  explicit Parts(std::byte* block) : block_(block) {}

  template <class T>
  T* take(std::int64_t count) {
    std::byte* const part = block_ == nullptr ? nullptr : block_ + used_;
    used_ += (static_cast<std::size_t>(count) * sizeof(T) + cache_line - 1) / cache_line * cache_line;
    return reinterpret_cast<T*>(part);
  }
  std::size_t used() const { return used_; }

 private:
  std::byte* block_;
  std::size_t used_ = 0;
};

void take_all(Parts& parts, WaveBuffers& b, bool encoding, bool two_bounds) {
  const Schedule& s = b.schedule;
  b.tables = parts.take<std::int16_t>(distribution_elements);
  b.voxel_lanes = parts.take<std::uint16_t>(s.period);
  b.strip.stride = s.size.x + 2 * Strip::margin;
  b.strip.first = parts.take<std::int16_t>(wave_lanes * b.strip.stride);
  for (int h = 0; h < 2; ++h) {
    b.lines[h] = parts.take<Line>(b.capacity);
    if (encoding) {
      b.originals[h] = parts.take<std::int16_t[wave_lanes]>(b.capacity);
      b.coded[h] = parts.take<Coded>(2 * s.period + 1);  // the next step, too
    }
    if (two_bounds) b.surface[h] = parts.take<std::uint16_t>(b.capacity);
  }
  if (!encoding) return;
  b.intervals = parts.take<Intervals>(2 * s.all_steps);
  b.interval_lanes = parts.take<IntervalLanes>(2 * s.all_steps);
}

}  // namespace

/// Sets only the sizes of the parts.
WaveBuffers::WaveBuffers(Index3 size) : schedule(size) {
  const Schedule& s = schedule;
  // Steps that are read before and after the present one of the even slices.
  reach = std::max(s.slice + s.lag + 8, 3 * s.period + 8);
  ahead = std::max(s.slice + 8, s.period + wave_slope + 16) + s.period;
  capacity = reach + ahead + std::min(3 * s.slice, s.all_steps);
}

std::uint64_t WaveBuffers::bytes(Index3 size, bool encoding, bool two_bounds) {
  WaveBuffers b(size);
  Parts parts(nullptr);
  take_all(parts, b, encoding, two_bounds);
  return parts.used() + cache_line +
         2 * sizeof(std::uint16_t) * static_cast<std::uint64_t>(b.schedule.all_groups + 1);
}

WaveBuffers::WaveBuffers(Index3 size, bool encoding, bool two_bounds, std::int16_t reference)
    : WaveBuffers(size) {
  const Schedule& s = schedule;
  Parts sizes(nullptr);
  take_all(sizes, *this, encoding, two_bounds);
  // The heap's own alignment is not enough.
  memory = std::make_unique_for_overwrite<std::byte[]>(sizes.used() + cache_line);
  const auto address = reinterpret_cast<std::uintptr_t>(memory.get());
  Parts parts(memory.get() + (cache_line - address % cache_line));
  take_all(parts, *this, encoding, two_bounds);

  first_line = -reach;
  Line outside;
  for (auto& value : outside.value) value = reference;
  std::memset(outside.size, 0, sizeof outside.size);
  for (int h = 0; h < 2; ++h) {
    std::fill_n(lines[h], capacity, outside);
    lines[h] -= first_line;
    if (encoding) {
      std::memset(originals[h], 0, static_cast<std::size_t>(capacity) * sizeof originals[h][0]);
      originals[h] -= first_line;
      quiet[static_cast<std::size_t>(h)].assign(static_cast<std::size_t>(s.all_groups + 1), 0xffff);
    }
    if (two_bounds) {
      std::memset(surface[h], 0, static_cast<std::size_t>(capacity) * sizeof surface[h][0]);
      surface[h] -= first_line;
    }
  }
  std::memset(strip.first, 0, static_cast<std::size_t>(wave_lanes * strip.stride) * sizeof(std::int16_t));
  for (std::int64_t phase = 0; phase < s.period; ++phase) {
    std::uint32_t lanes = 0;
    for (int i = 0; i < wave_lanes; ++i) {
      const std::int64_t step = (phase - wave_skew * i + s.period) % s.period;
      if (step >= wave_margin && step < size.x + wave_margin) lanes |= 1u << i;
    }
    voxel_lanes[phase] = static_cast<std::uint16_t>(lanes);
  }
}

}  // namespace tagrid
