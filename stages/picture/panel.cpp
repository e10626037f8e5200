#include "stages/picture/panel.h"

#include <algorithm>
#include <cmath>

namespace tagrid {
namespace {

// A panel smaller than this part of its place gets a scale of its own.
constexpr double least_share_of_scale = 0.6;

}  // namespace

Panel panel_of(const Index3& dims, const std::array<double, 3>& spacing, int axis, std::int64_t slice,
               int largest, int least) {
  const int across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
  const auto extent = [&](int a) {
    const double distance = std::abs(spacing[static_cast<std::size_t>(a)]);
    return static_cast<double>(dims[a]) * (distance > 0 && distance <= 1e300 ? distance : 1);
  };
  const double own = std::max(extent(across), extent(down)), of_all = std::max(own, extent(axis));
  const double longer = own >= least_share_of_scale * of_all ? of_all : own;
  const auto pixels = [&](int a) { return static_cast<int>(std::lround(extent(a) / longer * largest)); };
  return {axis,
          slice,
          {across, dims[across], std::max(least, pixels(across)), false},
          {down, dims[down], std::max(least, pixels(down)), down == 2},
          std::min(pixels(across), pixels(down)) >= least};
}

Panel detail_of(const Panel& panel, Index3 at) {
  // Seven: of the usual size, the detail has fewer than 128 samples along an axis. Where slices cross in a
  // corner of bricks of 64, as those in the middle often do, it lies in the four bricks around it.
  const std::int64_t pixels_of_sample = panel.block() > 1 ? 7 : 2;
  const auto share_of = [&](const PanelAxis& a) {
    return std::min(1.0, static_cast<double>(a.pixels) / static_cast<double>(pixels_of_sample * a.samples));
  };
  const double of_both = std::min(share_of(panel.across), share_of(panel.down));
  Panel detail = panel;
  for (PanelAxis* a : {&detail.across, &detail.down}) {
    const std::int64_t all = a->samples;
    const double share = panel.to_scale ? of_both : share_of(*a);
    a->block = 1;
    a->samples = std::max<std::int64_t>(1, static_cast<std::int64_t>(share * static_cast<double>(all)));
    a->first += std::clamp<std::int64_t>(at[a->axis] - a->first - a->samples / 2, 0, all - a->samples);
  }
  return detail;
}

}  // namespace tagrid
