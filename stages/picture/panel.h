// The size of a slice in a picture, and the sample that each pixel shows.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "stages/grid/box.h"

namespace tagrid {

/// Samples along one axis of a slice, in pixels.
struct PanelAxis {
  int axis = 0;              ///< of the volume
  std::int64_t samples = 1;  ///< that the panel shows along the axis
  int pixels = 1;
  bool reversed = false;   ///< The last sample comes first.
  std::int64_t first = 0;  ///< the first sample that the panel shows
  std::int64_t block = 1;  ///< factor of the overview whose means are read; 1: the samples themselves

  /// Distance of the samples that are read; 1 where every sample has a pixel.
  constexpr std::int64_t step() const {
    return block * std::max<std::int64_t>(1, samples / (pixels * block));
  }
  /// The number of samples that are read: first, first + step(), first + 2 * step(), ...
  constexpr std::int64_t count() const { return (samples - 1) / step() + 1; }

  /// Parts of the distance of two samples in which positions are given.
  static constexpr std::int64_t parts = 256;
  /// The place of the middle of a pixel in the volume, in parts. Each sample has the same length, of which it
  /// is the middle; in the outer halves of the first and the last one, the place is that of the sample.
  constexpr std::int64_t place(int pixel) const {
    const std::int64_t p = reversed ? pixels - 1 - pixel : pixel;
    return first * parts + std::clamp((2 * p + 1) * samples * parts / (2 * pixels) - parts / 2,
                                      std::int64_t{0}, (samples - 1) * parts);
  }
  /// The sample that a pixel shows, counted among those that are read: the nearest one, where all are read.
  constexpr std::int64_t number(int pixel) const {
    return std::min((place(pixel) + parts / 2) / parts - first, samples - 1) / step();
  }
  /// The pixel that shows the middle of a sample. REQUIRES: the panel shows it.
  constexpr int pixel_of(std::int64_t sample) const {
    const auto p = static_cast<int>((2 * (sample - first) + 1) * pixels / (2 * samples));
    return reversed ? pixels - 1 - p : p;
  }
};

/// A slice of a volume across an axis, as a rectangle of pixels.
struct Panel {
  int axis = 2;            ///< the slice is across it
  std::int64_t slice = 0;  ///< its sample along the axis
  PanelAxis across, down;
  /// False if a side was too short, so that lengths across and down cannot be compared.
  bool to_scale = true;

  /// Factor of the overview that the panel shows; 1: none.
  constexpr std::int64_t block() const { return across.block; }
  /// True if samples of the slice are left out, since they are twice as many as pixels or more, or if their
  /// means are shown.
  constexpr bool leaves_out() const { return across.step() > 1 || down.step() > 1; }
};

/// The panel of a slice, in its shape in the world. All panels of a volume have one scale, in which its
/// longest extent has `largest` pixels; but a panel whose longer side would have less than 0.6 of that is
/// enlarged to `largest`. A side has at least `least` pixels. A spacing that is not a positive number counts
/// as 1. The panel of z has x to the right and y down; that of y has x to the right and z up; that of x has y
/// to the right and z up.
Panel panel_of(const Index3& dims, const std::array<double, 3>& spacing, int axis, std::int64_t slice,
               int largest, int least);

/// The part of a panel around the sample `at`, enlarged to its size, so that each sample has two pixels or
/// more. If the panel is not to scale, a side on which they have as many stays complete. REQUIRES: the panel
/// shows `at`. If the panel shows means, the part shows samples, with seven pixels each: few bricks are read
/// then.
Panel detail_of(const Panel& panel, Index3 at);

/// A length that is easy to read, for a scale bar: the longest of 1, 2, 5, 10, 20, 50 ..., and of 0.5, 0.2,
/// 0.1 ..., that is at most `length`. REQUIRES: 1e-300 <= length <= 1e300.
constexpr double round_length(double length) {
  double power = 1;
  while (power * 10 <= length) power *= 10;
  // Divided from 1 down, which gives the doubles that are nearest to 0.1, 0.01 ...
  double divisor = 1;
  while (power / divisor > length) divisor *= 10;
  const double unit = power / divisor;
  return 5 * unit <= length ? 5 * unit : 2 * unit <= length ? 2 * unit : unit;
}

}  // namespace tagrid
