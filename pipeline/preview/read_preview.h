// Reads what a preview of a .tag file shows: a slice across each axis, and the levels of the grid in one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "io/tag/bricks.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "stages/picture/panel.h"

namespace tagrid {

struct PreviewWishes {
  /// The slice across each axis (x, y, z); by default the middle one. If samples are left out, the default of
  /// z is the first slice of a brick, which decodes fastest, if it is near the middle (within a twentieth).
  std::array<std::optional<std::int64_t>, 3> slices;
  int largest = 780;           ///< pixels of the longer side of a panel
  int largest_of_three = 512;  ///< the same if there are no levels
  int least = 24;              ///< pixels that the shorter side has at least
};

/// The samples of a panel, or their means, in the type of the volume and the machine's byte order. The first
/// index is across, the second down, of the numbers that PanelAxis::number() gives.
struct PreviewSlice {
  Panel panel;
  std::vector<std::byte> samples;
};

/// The leaf of the grid that a pixel shows.
struct LeafPixel {
  int level = 0;
  std::uint64_t leaf = 0;  ///< differs between leaves, except rare accidents
};

struct PreviewContent {
  std::array<PreviewSlice, 3> slices;  ///< across x, y and z
  /// What the levels are drawn over: the slice of z or, where samples are left out, its detail around the
  /// other slices. Without samples if the file stores no grid.
  PreviewSlice levels;
  /// For each pixel of that panel, in raster order, the leaf there; empty if the file stores no grid.
  std::vector<LeafPixel> leaves;
  std::int64_t bricks = 0;   ///< that were read, those of overviews included
  std::uint64_t memory = 0;  ///< planned at most, in bytes
};

/// The values of the samples of a slice, x + y * width, as doubles.
std::vector<double> values_of(const PreviewSlice& slice, SampleType type);

/// Reads the bricks that the slices meet, and decodes them no further than needed. The leaves are those just
/// below the slice of z (above the first slice), so that its plane cuts them. Where the file has an overview
/// that shows as much as a panel does, the slice is read from it. Memory: the slices, a brick for
/// each thread, and `besides`, which the caller needs besides the values_of() all slices. Throws UsageError
/// for a slice outside the volume, MemoryLimit, BrokenInput, WorldError, and the exceptions of `progress`.
PreviewContent read_preview(const TagBricks& file, const PreviewWishes& wishes, const Resources& resources,
                            std::uint64_t besides, const Progress& progress = {});

}  // namespace tagrid
