#include "io/formats/zarr/reader/series.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "io/programs/serve_reader.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// An axis besides x, y and z: of moments, of channels, or of anything else.
struct OtherAxis {
  std::size_t axis = 0;
  std::string letter, word;
  std::int64_t size = 1;
};

std::vector<OtherAxis> other_axes(const ZarrImage& image) {
  const auto space = image.space();
  std::vector<OtherAxis> others;
  for (std::size_t axis = image.axes.size(); axis-- > 0;) {
    if (std::ranges::find(space, std::optional(axis)) != space.end()) continue;
    std::string name = lower_case(image.axes[axis].name);
    // Up to version 0.2, all arrays have these axes.
    if (name.empty() && image.axes.size() == 5) name = axis == 0 ? "t" : "c";
    const std::string word = name == "t" || name == "time"      ? "moment"
                             : name == "c" || name == "channel" ? "channel"
                                                                : name;
    const std::string letter = word == "moment"    ? "t"
                               : word == "channel" ? "c"
                               : name.empty()      ? fmt::format("a{}_", axis)
                                                   : printable(name);
    others.push_back({axis, letter, word.empty() ? fmt::format("axis {}", axis) : printable(word),
                      image.array.shape[axis]});
  }
  return others;
}

}  // namespace

std::vector<std::int64_t> chosen_volume(const std::string& path, const ZarrImage& image,
                                        const std::string& wanted) {
  const std::vector<OtherAxis> others = other_axes(image);
  std::int64_t count = 1;
  for (const OtherAxis& other : others)
    if (other.size < 1 || other.size > most_volumes / count)
      throw broken_zarr(path, fmt::format("has {} of {} along the axis {}, which is too many volumes",
                                          other.size, other.word, other.letter));
    else
      count *= other.size;
  const auto numbers_of = [&](std::int64_t volume) {
    std::vector<std::int64_t> numbers(image.axes.size(), 0);
    for (const OtherAxis& other : others) {
      numbers[other.axis] = volume % other.size;
      volume /= other.size;
    }
    return numbers;
  };
  if (count == 1 && wanted.empty()) return numbers_of(0);
  std::vector<Choice> choices;
  for (std::int64_t volume = 0; volume < count; ++volume) {
    const std::vector<std::int64_t> numbers = numbers_of(volume);
    Choice choice;
    for (const OtherAxis& other : others) {
      if (other.size == 1) continue;
      choice.name += fmt::format("{}{}", other.letter, numbers[other.axis] + 1);
      choice.text += fmt::format("{}{} {} of {}", choice.text.empty() ? "" : ", ", other.word,
                                 numbers[other.axis] + 1, other.size);
    }
    choices.push_back(std::move(choice));
  }
  return numbers_of(static_cast<std::int64_t>(chosen(path, "series", wanted, choices)));
}

}  // namespace tagrid
