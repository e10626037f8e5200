#include "io/formats/axes/geometry_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "io/programs/words.h"

namespace tagrid {
namespace {

constexpr std::size_t most_named = 8;

/// Attributes of HDF5, netCDF and NeXus that have such words and another meaning.
constexpr std::array<std::string_view, 7> other_meanings = {
    "scale_factor",     "add_offset",      "scaling_factor", "dimension_list",
    "dimension_labels", "dimension_scale", "reference_list"};

constexpr std::array<std::string_view, 13> whole_words = {"scale", "scales", "offset", "offsets", "axes",
                                                          "axis",  "origin", "step",   "steps",   "origins",
                                                          "apix",  "cosine", "cosines"};

constexpr std::array<std::string_view, 9> parts = {"spacing",     "resolution",  "voxel",
                                                   "pixelsize",   "elementsize", "direction",
                                                   "orientation", "affine",      "transform"};

/// "PixelSize_um" is "pixel", "size" and "um".
std::vector<std::string> lower_words(std::string_view name) {
  std::vector<std::string> words(1);
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto at = [&](std::size_t j) { return static_cast<unsigned char>(name[j]); };
    const bool begins = i > 0 && std::isupper(at(i)) != 0 && std::islower(at(i - 1)) != 0;
    if (begins || std::isalpha(at(i)) == 0) words.emplace_back();
    if (std::isalpha(at(i)) != 0) words.back() += static_cast<char>(std::tolower(at(i)));
  }
  std::erase(words, "");
  return words;
}

}  // namespace

bool looks_like_geometry(std::string_view name) {
  const std::string lower = lower_case(name);
  if (std::ranges::find(other_meanings, lower) != other_meanings.end() || lower.ends_with("_indices"))
    return false;
  std::string letters;
  bool has_unit = false, has_length = false;
  for (const std::string& word : lower_words(name)) {
    if (std::ranges::find(whole_words, word) != whole_words.end()) return true;
    has_unit |= word == "unit" || word == "units";
    has_length |=
        word == "length" || word == "distance" || word == "space" || word == "spatial" || word == "grid";
    letters += word;
  }
  if (has_unit && has_length) return true;
  if (letters == "xorigin" || letters == "yorigin" || letters == "zorigin") return true;
  return std::ranges::any_of(parts,
                             [&](std::string_view part) { return letters.find(part) != letters.npos; });
}

std::string about_unread_geometry(const std::string& object, const std::vector<std::string>& names) {
  return fmt::format(
      "{}: {} may describe the geometry, but {} not understood and not used; if the spacing is wrong or "
      "missing, use --override-spacing",
      object, listed(names, most_named), names.size() == 1 ? "is" : "are");
}

std::string about_assumed_order(const std::string& object, std::string_view attribute) {
  return fmt::format(
      "{}: {} is read as x, y, z, because its order is not stated; if that is wrong, use --override-spacing",
      object, attribute);
}

}  // namespace tagrid
