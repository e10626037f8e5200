#include "io/formats/hdf5/reader/meaning.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "io/errors/errors.h"
#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/conventions.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/emd.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/formats/hdf5/reader/nexus.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// "xyz" is three names, if there are three axes.
std::vector<std::string> letters_of(std::vector<std::string> names, std::size_t axes) {
  if (names.size() != 1 || names[0].size() != axes || axes < 2) return names;
  std::vector<std::string> letters;
  for (const char letter : names[0]) letters.emplace_back(1, letter);
  return letters;
}

/// The names of axes that HDF5 dimensions have as labels, otherwise those of NeXus, of EMD, of MINC, of Velox,
/// or of vigra and ilastik. `source` becomes the one that has them.
std::vector<std::string> names_of_axes(hid_t group, hid_t dataset, const std::string& path,
                                       std::string& source) {
  source = "DIMENSION_LABELS";
  if (std::vector<std::string> labels = text_list_attribute(dataset, source); !labels.empty()) return labels;
  source = "axes";
  if (std::vector<std::string> names = names_of_nexus_axes(group, dataset); !names.empty())
    return letters_of(std::move(names), dims_of(dataset).size());
  source = "EMD";
  if (std::vector<std::string> names =
          names_of_emd_axes(group, group_and_name(path).second, dims_of(dataset).size());
      !names.empty())
    return names;
  std::vector<std::string> names;
  for (const char* attribute : {"dimorder", "axis_order", "dimension_order"}) {
    source = attribute;
    std::string order = text_attribute(dataset, source).value_or("");
    std::ranges::replace(order, ',', ' ');
    for (const std::string_view name : words_of(order))
      names.emplace_back(name.substr(0, name.find("space")));
    if (names.empty()) names = text_list_attribute(dataset, source);
    if (!names.empty()) return letters_of(std::move(names), dims_of(dataset).size());
  }
  source = "DIMENSION_LIST";
  if (std::vector<std::string> scales = names_of_scales(dataset); !scales.empty()) return scales;
  source = "Velox";
  if (path.starts_with("/Data/Image/") && path.ends_with("/Data")) return {"y", "x", "frame"};
  source = "axistags";
  const auto tags = nlohmann::json::parse(text_attribute(dataset, source).value_or(""), nullptr, false);
  if (!tags.is_object() || !tags.contains("axes")) return {};
  for (const auto& axis : tags["axes"])
    if (axis.is_object() && axis.contains("key") && axis["key"].is_string())
      names.push_back(axis["key"].get<std::string>());
  return names;
}

/// True if an axis is called like another one of a volume, the slowest one first.
bool are_in_another_order(const std::vector<std::string>& names) {
  constexpr std::string_view space = "xyz";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = lower_case(names[i]);
    const std::size_t from_end = names.size() - 1 - i;
    if (name == "c" || name == "t" || name == "channel" || name == "time") return true;
    if (name.size() == 1 && space.find(name) != space.npos && space.find(name) != from_end) return true;
  }
  return false;
}

}  // namespace

bool has_names_of_axes(hid_t file, const std::string& name) {
  const Hdf5Handle dataset = opened_dataset(file, name);
  const Hdf5Handle group(H5Oopen(file, group_and_name(inside("/", name)).first.c_str(), H5P_DEFAULT),
                         H5Oclose);
  std::string source;
  return names_of_axes(group.get(), dataset.get(), inside("/", name), source).size() ==
         dims_of(dataset.get()).size();
}

std::vector<std::string> other_meanings(hid_t file, const std::string& name, const std::string& object,
                                        Index3 dims, bool are_axes_placed) {
  std::vector<std::string> sentences;
  const auto say = [&](const std::string& what) { sentences.push_back(object + ": " + what); };
  const Hdf5Handle dataset = opened_dataset(file, name);
  const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
  const std::string path = inside("/", name);
  const Hdf5Handle group(H5Oopen(file, group_and_name(path).first.c_str(), H5P_DEFAULT), H5Oclose);
  std::string source;
  auto names = names_of_axes(group.get(), dataset.get(), path, source);
  // Axes in front with one sample are left out.
  const auto lengths = dims_of(dataset.get());
  if (names.size() == lengths.size())
    names.erase(
        names.begin(),
        names.begin() + (std::ranges::find_if(lengths, [](hsize_t n) { return n > 1; }) - lengths.begin()));
  if (!are_axes_placed && are_in_another_order(names))
    say(fmt::format("its axes are called {} ({}), the slowest one first, but are read as z, y, x",
                    fmt::join(names, ", "), source));
  const std::string subclass = text_attribute(dataset.get(), "IMAGE_SUBCLASS").value_or("");
  if (subclass == "IMAGE_TRUECOLOR")
    throw BrokenInput(object + " has colors (IMAGE_SUBCLASS is IMAGE_TRUECOLOR), not one value a sample");
  for (const double components : number_attribute(dataset.get(), "ComponentDimensions"))
    if (components > 1)
      throw BrokenInput(
          fmt::format("{} has {} values a sample (ComponentDimensions), not one", object, components));
  if (subclass == "IMAGE_INDEXED")
    say("its samples are numbers of colors (IMAGE_SUBCLASS is IMAGE_INDEXED), but are read as values");
  if (const auto white = number_attribute(dataset.get(), "IMAGE_WHITE_IS_ZERO");
      !white.empty() && white[0] == 1)
    say("small numbers mean white (IMAGE_WHITE_IS_ZERO); numbers are kept as they are");
  for (const auto& [scale, neutral] : {std::pair("RescaleSlope", 1.0), std::pair("RescaleIntercept", 0.0)})
    if (H5Aexists(dataset.get(), scale) > 0 &&
        number_attribute(dataset.get(), scale) != std::vector<double>{neutral})
      say(fmt::format("{} is {}, which is not applied; numbers are kept as they are", scale,
                      tagrid::quoted(attribute_in_words(dataset.get(), scale))));
  // "/t00000/s00/0/cells"
  if (path.starts_with("/t") && path.ends_with("/cells"))
    say("BigDataViewer keeps the positions of samples in an XML file, which is not read; set the spacing "
        "with --override-spacing");
  if (path.starts_with("/t") && path.ends_with("/cells") && H5Tequal(type.get(), H5T_STD_I16LE) > 0)
    say("BigDataViewer takes these numbers for unsigned ones; they are read as signed ones, as they are "
        "stored");
  const std::array sizes = {dims.x, dims.y, dims.z};
  for (std::size_t axis = 0; group && axis < 3; ++axis) {
    const std::string size = fmt::format("ImageSize{}", "XYZ"[axis]);
    const ForeignNumber number = number_of_letters(group.get(), size);
    if (number.is_number() && number.value != static_cast<double>(sizes[axis]))
      say(fmt::format("{} is {}, but the data set has {}; what is beyond it may be no part of the image",
                      size, number.value, sizes[axis]));
  }
  return sentences;
}

}  // namespace tagrid
