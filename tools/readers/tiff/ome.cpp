#include "tools/readers/tiff/ome.h"

#include <fmt/format.h>

#include <pugixml.hpp>

#include "io/files/errors.h"
#include "tools/readers/tiff/image_j.h"

namespace tagrid {
namespace {

[[noreturn]] void fail(const std::string& why) { throw BrokenInput("TIFF file: OME-XML: " + why); }

/// Elements may have a prefix: ome:Image.
bool has_name(const pugi::xml_node& node, std::string_view name) {
  std::string_view full = node.name();
  return full.substr(full.rfind(':') + 1) == name;
}

std::vector<pugi::xml_node> children_of(const pugi::xml_node& node, std::string_view name) {
  std::vector<pugi::xml_node> found;
  for (const pugi::xml_node& child : node.children())
    if (has_name(child, name)) found.push_back(child);
  return found;
}

std::int64_t count_of(const pugi::xml_node& node, const char* name, std::int64_t otherwise) {
  const std::int64_t count = node.attribute(name).as_llong(otherwise);
  constexpr std::int64_t most = std::int64_t{1} << 31;
  if (count < 0 || count > most) fail(fmt::format("{} is {}", name, count));
  return count;
}

/// Of units of length in the OME model; 0 for others.
double micrometres_in(std::string_view unit) {
  const std::string plain = plain_unit(unit);
  if (plain == "nm") return 1e-3;
  if (plain == "um") return 1;
  if (plain == "mm") return 1e3;
  if (plain == "cm") return 1e4;
  if (plain == "m") return 1e6;
  return 0;
}

void read_spacing(const pugi::xml_node& pixels, OmeImage& image) {
  image.unit = plain_unit(pixels.attribute("PhysicalSizeXUnit").as_string("um"));
  constexpr std::array axes = {"X", "Y", "Z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name = fmt::format("PhysicalSize{}", axes[axis]);
    const std::string unit = plain_unit(pixels.attribute((name + "Unit").c_str()).as_string("um"));
    const double size = pixels.attribute(name.c_str()).as_double(0);
    const double factor = unit == image.unit ? 1
                          : micrometres_in(image.unit) == 0
                              ? 0
                              : micrometres_in(unit) / micrometres_in(image.unit);
    if (size > 0 && factor > 0) image.spacing[axis] = size * factor;
  }
}

/// The planes as pages follow each other.
class Order {
 public:
  Order(const std::string& names, const OmeImage& image) : image_(image) {
    if (names.size() != 5 || !names.starts_with("XY")) fail(fmt::format("DimensionOrder is {}", names));
    for (std::size_t i = 0; i < 3; ++i) {
      names_[i] = names[i + 2];
      sizes_[i] = size_along(names_[i]);
    }
    if (std::string_view("ZCT").find_first_of(names_[0]) == std::string_view::npos ||
        names_[0] == names_[1] || names_[1] == names_[2] || names_[0] == names_[2])
      fail(fmt::format("DimensionOrder is {}", names));
  }
  std::int64_t number_of(std::int64_t z, std::int64_t c, std::int64_t t) const {
    return z + image_.slices * (c + image_.channels * t);
  }
  /// Moves to the plane of the next page; false after the last one.
  bool next(std::int64_t& z, std::int64_t& c, std::int64_t& t) const {
    for (std::size_t i = 0; i < 3; ++i) {
      std::int64_t& at = names_[i] == 'Z' ? z : names_[i] == 'C' ? c : t;
      if (++at < sizes_[i]) return true;
      at = 0;
    }
    return false;
  }

 private:
  std::int64_t size_along(char name) const {
    if (name == 'Z') return image_.slices;
    if (name == 'C') return image_.channels;
    if (name == 'T') return image_.times;
    fail(fmt::format("DimensionOrder has an axis {}", name));
  }

  const OmeImage& image_;
  std::array<char, 3> names_ = {};
  std::array<std::int64_t, 3> sizes_ = {};
};

void place(const pugi::xml_node& data, const Order& order, std::int64_t pages, OmeImage& image) {
  std::int64_t z = count_of(data, "FirstZ", 0), c = count_of(data, "FirstC", 0),
               t = count_of(data, "FirstT", 0);
  if (z >= image.slices || c >= image.channels || t >= image.times) fail("TiffData begins outside its image");
  std::string file;
  for (const pugi::xml_node& id : children_of(data, "UUID")) file = id.attribute("FileName").as_string();
  const bool names_page = !data.attribute("IFD").empty();
  std::int64_t page = count_of(data, "IFD", 0);
  std::int64_t count = count_of(data, "PlaneCount", names_page ? 1 : pages);
  for (; count > 0; --count, ++page) {
    image.planes[static_cast<std::size_t>(order.number_of(z, c, t))] = {file, page};
    if (!order.next(z, c, t)) return;
  }
}

OmeImage image_of(const pugi::xml_node& node, std::int64_t pages) {
  OmeImage image;
  image.name = node.attribute("Name").as_string();
  const auto all = children_of(node, "Pixels");
  if (all.size() != 1) fail("an image does not have one element Pixels");
  const pugi::xml_node& pixels = all.front();
  image.slices = count_of(pixels, "SizeZ", 1);
  image.channels = count_of(pixels, "SizeC", 1);
  image.times = count_of(pixels, "SizeT", 1);
  // Planes are pages of files: not more than can be in a text of them.
  constexpr std::int64_t most = std::int64_t{1} << 20;
  if (image.slices < 1 || image.channels < 1 || image.times < 1 || image.channels > most ||
      image.times > most || image.slices > most || image.slices * image.channels > most ||
      image.slices * image.channels * image.times > most)
    fail(fmt::format("an image has {} slices, {} channels and {} moments", image.slices, image.channels,
                     image.times));
  image.planes.resize(static_cast<std::size_t>(image.slices * image.channels * image.times));
  read_spacing(pixels, image);
  const Order order(pixels.attribute("DimensionOrder").as_string("XYZCT"), image);
  for (const pugi::xml_node& data : children_of(pixels, "TiffData")) place(data, order, pages, image);
  return image;
}

}  // namespace

std::optional<std::vector<OmeImage>> ome_images_of(std::string_view description, std::int64_t pages) {
  if (description.find("<OME") == description.npos && description.find(":OME") == description.npos)
    return std::nullopt;
  pugi::xml_document document;
  if (const auto result = document.load_buffer(description.data(), description.size()); !result)
    fail(fmt::format("{} at byte {}", result.description(), result.offset));
  std::vector<OmeImage> images;
  for (const pugi::xml_node& image : children_of(document.document_element(), "Image"))
    images.push_back(image_of(image, pages));
  if (images.empty()) return std::nullopt;
  return images;
}

}  // namespace tagrid
