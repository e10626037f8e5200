#include "io/formats/hdf5/description.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "io/errors/errors.h"
#include "io/formats/hdf5/attributes.h"
#include "io/metadata/text.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// Beyond, attributes take long to write, and only the header lines have the pairs.
constexpr std::size_t most_attributes = 1000;

class Description {
 public:
  /// Without an effect if the name is taken.
  void add(std::string name, std::variant<std::string, std::vector<double>> value) {
    const bool is_taken =
        name.empty() || name == hdf5_header_attribute ||
        std::ranges::any_of(all_, [&](const Hdf5Attribute& other) { return other.name == name; });
    if (!is_taken && all_.size() < most_attributes) all_.push_back({std::move(name), std::move(value)});
  }

  std::vector<Hdf5Attribute> take() { return std::move(all_); }

 private:
  std::vector<Hdf5Attribute> all_;
};

std::vector<double> numbers_of(const std::array<double, 3>& numbers) {
  return {numbers.begin(), numbers.end()};
}

std::string in_words(const std::array<std::string, 3>& units) {
  if (units[0] == units[1] && units[0] == units[2]) return units[0];
  std::string words;
  for (const std::string& unit : units) words += (words.empty() ? "" : ", ") + (unit.empty() ? "?" : unit);
  return words;
}

void add_geometry(const Geometry& geometry, Description& description) {
  if (geometry.has_spacing) description.add("spacing", numbers_of(geometry.spacing));
  if (geometry.has_origin) description.add("origin", numbers_of(geometry.origin));
  if (geometry.has_directions) {
    std::vector<double> directions;
    for (const auto& axis : geometry.directions)
      directions.insert(directions.end(), axis.begin(), axis.end());
    description.add("directions", std::move(directions));
  }
  if (!geometry.space.empty()) description.add("space", geometry.space);
  if (geometry.units != std::array<std::string, 3>())
    description.add("spacing_units", in_words(geometry.units));
}

void add_pair(const std::string& key, const std::string& value, Description& description) {
  constexpr std::string_view of_hdf5 = "hdf5_";
  if (key == "hdf5_dataset") return;  // it is another one now
  if (key == "rescale_slope" || key == "rescale_intercept")
    if (const auto number = number_of(value)) return description.add(key, std::vector{*number});
  description.add(key.starts_with(of_hdf5) ? key.substr(of_hdf5.size()) : key, value);
}

/// Attributes that say where samples lie and what they mean.
constexpr std::array geometry_attributes = {"spacing",       "origin",        "directions",       "space",
                                            "spacing_units", "rescale_slope", "rescale_intercept"};

bool is_same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool says(hid_t object, const Hdf5Attribute& attribute) {
  if (const auto* text = std::get_if<std::string>(&attribute.value))
    return text_attribute(object, attribute.name) == *text;
  return std::ranges::equal(number_attribute(object, attribute.name),
                            std::get<std::vector<double>>(attribute.value), is_same);
}

}  // namespace

std::vector<Hdf5Attribute> attributes_of(const Metadata& metadata) {
  Description description;
  add_geometry(metadata.geometry(), description);
  for (const auto& [key, value] : metadata.pairs()) add_pair(key, value, description);
  return description.take();
}

std::optional<Metadata> header_of(hid_t object, std::vector<std::string>& described) {
  const auto header = text_attribute(object, hdf5_header_attribute);
  if (!header) return std::nullopt;
  Metadata metadata;
  try {
    metadata = parse_metadata(*header);
  } catch (const BrokenInput&) {
    return std::nullopt;  // another program's
  }
  std::vector<Hdf5Attribute> attributes = attributes_of(metadata);
  if (!std::ranges::all_of(attributes, [&](const auto& attribute) { return says(object, attribute); }))
    return std::nullopt;
  std::vector<std::string> names;
  for (Hdf5Attribute& attribute : attributes) names.push_back(std::move(attribute.name));
  const auto was_added = [&](const char* name) {
    return std::ranges::find(names, name) == names.end() && H5Aexists(object, name) > 0;
  };
  if (std::ranges::any_of(geometry_attributes, was_added)) return std::nullopt;
  described = std::move(names);
  return metadata;
}

}  // namespace tagrid
