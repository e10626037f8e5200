#include "tools/preview/sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "io/text/text.h"
#include "stages/picture/image.h"
#include "stages/picture/panel.h"

namespace tagrid {
namespace {

constexpr Colour background = {18, 20, 24}, bright = {236, 238, 242}, dim = {160, 166, 176};
// Slices across x, y and z, and the marks where they cut the others.
constexpr std::array<Colour, 3> axis_colours = {{{238, 105, 96}, {110, 200, 110}, {104, 160, 245}}};

constexpr int margin = 16, widest_cell = (sheet_width - 3 * margin) / 2;
constexpr int small = 2, large = 3;
constexpr int line_height = text_height * small + 8;
constexpr int header_height = margin + text_height * large + 2 * line_height + 22;
constexpr int tick = 8;  // room for a mark
constexpr int mark = 6;  // so that those of panels beside each other do not touch
constexpr int caption_height = tick + 6 + 2 * line_height + 24;
constexpr int highest_sheet = header_height + 2 * (widest_cell + caption_height) + margin;

/// A rectangle of the sheet that shows a slice.
struct Placed {
  const PreviewSlice& slice;
  int x, y;

  int right() const { return x + slice.panel.across.pixels; }
  int bottom() const { return y + slice.panel.down.pixels; }
};

/// The text, or its beginning and "..." if it is wider than `width`.
std::string fitted(std::string text, int width) {
  if (text_width(text, small) <= width) return text;
  do {
    do text.pop_back();
    while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xc0) == 0x80);
  } while (!text.empty() && text_width(text + "...", small) > width);
  return text + "...";
}

bool has_levels(const PreviewContent& content) { return !content.leaves.empty(); }

/// Two places beside each other, or three.
int cell_width(const PreviewContent& content) {
  return has_levels(content) ? widest_cell : (sheet_width - 4 * margin) / 3;
}

class Drawing {
 public:
  explicit Drawing(const Sheet& sheet)
      : sheet_(sheet),
        places_(places_on_sheet(sheet.content)),
        cell_(cell_width(sheet.content)),
        image_(sheet_width, lowest_row() + caption_height, background) {}

  Image draw() && {
    header();
    for (const std::size_t axis : {0, 1, 2}) grey_panel(placed(axis, places_.slices[axis]));
    frame_of_detail(places_.slices[2]);
    if (has_levels(sheet_.content)) levels_panel({sheet_.content.levels, places_.levels.x, places_.levels.y});
    return std::move(image_);
  }

 private:
  const Panel& panel(std::size_t axis) const { return sheet_.content.slices[axis].panel; }

  int lowest_row() const {
    int lowest = 0;
    for (const std::size_t axis : {0, 1, 2})
      lowest = std::max(lowest, places_.slices[axis].y + panel(axis).down.pixels);
    return lowest;
  }

  Placed placed(std::size_t axis, const SheetPlaces::Corner& at) const {
    return {sheet_.content.slices[axis], at.x, at.y};
  }

  void header() {
    // A title of any length stays on the sheet.
    const std::string title = printable(sheet_.title);
    const int scale = text_width(title, large) <= sheet_width - 2 * margin ? large : small;
    draw_text(image_, margin, margin, scale == large ? title : fitted(title, sheet_width - 2 * margin), scale,
              bright);
    int y = margin + text_height * large + 10;
    for (const std::string& line : sheet_.lines) {
      draw_text(image_, margin, y, fitted(line, sheet_width - 2 * margin), small, dim);
      y += line_height;
    }
  }

  template <class ColourOf>
  void fill_panel(const Placed& at, ColourOf colour_of) {
    const Panel& p = at.slice.panel;
    const std::vector<double> values = values_of(at.slice, sheet_.type);
    // Numbers take divisions.
    std::vector<std::int64_t> numbers;
    for (int u = 0; u < p.across.pixels; ++u) numbers.push_back(p.across.number(u));
    for (int v = 0; v < p.down.pixels; ++v) {
      const std::int64_t row = p.down.number(v) * p.across.count();
      for (int u = 0; u < p.across.pixels; ++u) {
        const double sample = values[static_cast<std::size_t>(row + numbers[static_cast<std::size_t>(u)])];
        const auto grey = sheet_.window.grey(sheet_.rescale.slope * sample + sheet_.rescale.intercept);
        image_.set(at.x + u, at.y + v, colour_of(u, v, grey));
      }
    }
  }

  static Colour colour_of_grey(std::optional<std::uint8_t> grey) {
    return grey ? Colour{*grey, *grey, *grey} : colour_of_nan;
  }

  void grey_panel(const Placed& at) {
    fill_panel(at, [](int, int, std::optional<std::uint8_t> grey) { return colour_of_grey(grey); });
    marks_of_other_slices(at);
    const int y = caption(at, slice_caption(at.slice.panel, sheet_.lengths));
    scale_bar(at.slice.panel, at.x, y);
    grey_ramp(at.x + cell_, y);
  }

  void levels_panel(const Placed& at) {
    const Panel& p = at.slice.panel;
    const int deepest = max_level(sheet_.cube_size);
    const auto leaf = [&](int u, int v) -> const LeafPixel& {
      return sheet_.content.leaves[static_cast<std::size_t>(v) * static_cast<std::size_t>(p.across.pixels) +
                                   static_cast<std::size_t>(u)];
    };
    const auto is_outline = [&](int u, int v) {
      const LeafPixel& here = leaf(u, v);
      const auto differs = [&](const LeafPixel& there) {
        return there.leaf != here.leaf && has_room(p, std::max(here.level, there.level));
      };
      return (u > 0 && differs(leaf(u - 1, v))) || (v > 0 && differs(leaf(u, v - 1)));
    };
    fill_panel(at, [&](int u, int v, std::optional<std::uint8_t> grey) {
      const Colour colour =
          mixed(colour_of_grey(grey), colour_of_level(leaf(u, v).level, deepest), level_share);
      return is_outline(u, v) ? mixed(colour, background, outline_share) : colour;
    });
    marks_of_other_slices(at);
    const std::string_view where = panel(2).leaves_out() ? "in the frame " : "";
    legend(at.x, caption(at, fmt::format("levels of the grid {}(cubes of {})", where, sheet_.cube_size)),
           deepest);
  }

  /// Around what the panel of levels shows of the slice, if that is not all.
  void frame_of_detail(const SheetPlaces::Corner& at) {
    const Panel &whole = panel(2), &detail = sheet_.content.levels.panel;
    if (!whole.leaves_out() || sheet_.content.leaves.empty()) return;
    struct Side {
      int low, high;
    };
    const auto side = [](const PanelAxis& of_whole, const PanelAxis& of_detail) {
      return Side{of_whole.pixel_of(of_detail.first),
                  of_whole.pixel_of(of_detail.first + of_detail.samples - 1)};
    };
    const Side x = side(whole.across, detail.across), y = side(whole.down, detail.down);
    // A bright line on a dark one, to be seen on any grey.
    const auto draw = [&](int thickness, Colour colour) {
      const int beside = thickness / 2, left = at.x + x.low - beside, top = at.y + y.low - beside,
                width = x.high - x.low + thickness, height = y.high - y.low + thickness;
      for (const int row : {top, top + y.high - y.low}) image_.fill(left, row, width, thickness, colour);
      for (const int column : {left, left + x.high - x.low})
        image_.fill(column, top, thickness, height, colour);
    };
    draw(3, background);
    draw(1, bright);
  }

  /// True if the tetrahedra of a level are so large that their outlines leave room for their colour.
  bool has_room(const Panel& p, int level) const {
    const int edge = sheet_.cube_size >> (level / 3);
    return std::int64_t{edge} * p.across.pixels >= 14 * p.across.samples;
  }

  /// Where the slices across the axes of this panel are.
  void marks_of_other_slices(const Placed& at) {
    const Panel& p = at.slice.panel;
    const auto pixel = [&](const PanelAxis& axis) {
      return axis.pixel_of(panel(static_cast<std::size_t>(axis.axis)).slice);
    };
    const Colour across = axis_colours[static_cast<std::size_t>(p.across.axis)],
                 down = axis_colours[static_cast<std::size_t>(p.down.axis)];
    const int x = at.x + pixel(p.across), y = at.y + pixel(p.down);
    for (const int top : {at.y - mark - 1, at.bottom() + 1}) image_.fill(x - 1, top, 2, mark, across);
    for (const int left : {at.x - mark - 1, at.right() + 1}) image_.fill(left, y - 1, mark, 2, down);
  }

  /// Writes a line below a panel, and returns the y of the next one.
  int caption(const Placed& at, const std::string& text) {
    const int y = at.bottom() + tick + 6;
    const auto axis = static_cast<std::size_t>(at.slice.panel.axis);
    image_.fill(at.x, y, 6, text_height * small - 2, axis_colours[axis]);
    draw_text(image_, at.x + 14, y, text, small, bright);
    const std::string directions = direction_caption(at.slice.panel);
    const int left = at.x + cell_ - text_width(directions, small);
    if (left > at.x + 14 + text_width(text, small) + 16) draw_text(image_, left, y, directions, small, dim);
    return y + line_height + 4;
  }

  void scale_bar(const Panel& p, int x, int y) {
    const double spacing = sheet_.lengths.spacing(p.across.axis);
    const double longest = std::min(p.across.pixels, cell_ == widest_cell ? 260 : 150) * spacing *
                           static_cast<double>(p.across.samples) / p.across.pixels;
    if (!(longest >= 1e-300 && longest <= 1e300)) return;
    const double length = round_length(longest);
    const int pixels = std::max(
        1,
        static_cast<int>(length / spacing / static_cast<double>(p.across.samples) * p.across.pixels + 0.5));
    image_.fill(x, y + 6, pixels, 3, bright);
    for (const int end : {x, x + pixels - 2}) image_.fill(end, y, 2, 15, bright);
    const std::string unit = sheet_.lengths.unit(p.across.axis);
    draw_text(image_, x + pixels + 12, y, length_words(length, unit), small, bright);
  }

  /// The grey levels of the window, up to `right`.
  void grey_ramp(int right, int y) {
    const std::string low = short_number(sheet_.window.low);
    std::string high = short_number(sheet_.window.high);
    if (!sheet_.rescale.units.empty()) high += " " + printable(sheet_.rescale.units).substr(0, 12);
    int x = right - text_width(high, small);
    draw_text(image_, x, y, high, small, bright);
    const int width = cell_ == widest_cell ? 128 : 64;
    x -= width + 12;
    for (int i = 0; i < width; ++i) {
      const auto grey = static_cast<std::uint8_t>(i * 255 / (width - 1));
      image_.fill(x + i, y, 1, text_height * small - 2, {grey, grey, grey});
    }
    draw_text(image_, x - 12 - text_width(low, small), y, low, small, bright);
  }

  /// The colours of the levels, from coarse to fine.
  void legend(int x, int y, int deepest) {
    const std::string coarse = "coarse", fine = "fine";
    draw_text(image_, x, y + 4, coarse, small, bright);
    const int first = x + text_width(coarse, small) + 12,
              width = (x + cell_ - text_width(fine, small) - 12 - first) / (deepest + 1);
    for (int level = 0; level <= deepest; ++level) {
      const Colour colour = colour_of_level(level, deepest);
      image_.fill(first + level * width, y, width - 2, 22, colour);
      const std::string number = std::to_string(level);
      const bool is_light = colour.red + 2 * colour.green + colour.blue / 2 > 360;
      if (const int left = width - 2 - text_width(number, small); left >= 0)
        draw_text(image_, first + level * width + left / 2, y + 4, number, small,
                  is_light ? background : bright);
    }
    draw_text(image_, first + (deepest + 1) * width + 10, y + 4, fine, small, bright);
  }

  // Parts of 256.
  static constexpr int level_share = 150, outline_share = 110;

  const Sheet& sheet_;
  SheetPlaces places_;
  int cell_;
  Image image_;
};

}  // namespace

std::uint64_t memory_of_sheet() {
  // libpng and zlib take less than a mebibyte.
  return std::uint64_t{sheet_width} * highest_sheet * sizeof(Colour) + (std::uint64_t{1} << 20);
}

SheetPlaces places_on_sheet(const PreviewContent& content) {
  constexpr int left = margin, upper = header_height;
  const int cell = cell_width(content), right = 2 * margin + cell;
  if (!has_levels(content)) return {{{{right + cell + margin, upper}, {right, upper}, {left, upper}}}, {}};
  const int lower = upper + content.slices[2].panel.down.pixels + caption_height;
  return {{{{right, lower}, {left, lower}, {left, upper}}}, {right, upper}};
}

GreyWindow window_of(const PreviewContent& content, SampleType type, const Rescale& rescale) {
  std::size_t count = 0;
  for (const PreviewSlice& slice : content.slices) count += slice.samples.size() / size_of(type);
  std::vector<double> values;
  values.reserve(count);
  for (const PreviewSlice& slice : content.slices)
    for (const double sample : values_of(slice, type))
      values.push_back(rescale.slope * sample + rescale.intercept);
  return window_of(values);
}

Image sheet_of(const Sheet& sheet) { return Drawing(sheet).draw(); }

}  // namespace tagrid
