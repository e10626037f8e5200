// The picture of a preview: two panels above two or, without levels, three beside each other; with captions.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"
#include "pipeline/preview/read_preview.h"
#include "stages/picture/grey_window.h"
#include "stages/picture/image.h"
#include "tools/preview/captions.h"

namespace tagrid {

/// What a sheet shows.
struct Sheet {
  std::string title;
  std::vector<std::string> lines;  ///< about the file
  const PreviewContent& content;
  SampleType type = SampleType::uint8;
  Rescale rescale;
  GreyWindow window;  ///< of rescaled values
  Lengths lengths;
  int cube_size = 32;
};

/// Width of a sheet in pixels.
inline constexpr int sheet_width = 1600;
/// A sample that is not a number.
inline constexpr Colour colour_of_nan = {214, 39, 140};

/// The bytes that a sheet takes at most, besides its content and the values of all its samples.
std::uint64_t memory_of_sheet();

/// The window of all samples that the panels show; see window_of().
GreyWindow window_of(const PreviewContent& content, SampleType type, const Rescale& rescale);

/// The upper left pixels of the panels.
struct SheetPlaces {
  struct Corner {
    int x, y;
  };
  std::array<Corner, 3> slices;  ///< across x, y and z
  Corner levels;                 ///< if the content has leaves
};
SheetPlaces places_on_sheet(const PreviewContent& content);

/// Draws the sheet: above, the slice of z and the same slice with levels; below, the slices of y and x.
/// Without levels, the slices of z, y and x are one row.
Image sheet_of(const Sheet& sheet);

}  // namespace tagrid
