#include "io/formats/tiff/reader/ome.h"

#include <fmt/format.h>

#include <algorithm>
#include <pugixml.hpp>

#include "io/errors/errors.h"
#include "io/text/text.h"

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

/// A number that says which samples there are: nothing if it is absent.
std::optional<std::int64_t> count_of(const pugi::xml_node& node, const char* name) {
  const pugi::xml_attribute attribute = node.attribute(name);
  if (attribute.empty()) return std::nullopt;
  const auto count = whole_number_of(trimmed(attribute.as_string()));
  constexpr std::int64_t most = std::int64_t{1} << 31;
  if (!count || *count < 0 || *count > most)
    fail(fmt::format("{} is {}, which is no count", name,
                     tagrid::quoted(std::string_view(attribute.as_string()))));
  return count;
}

GivenDistance distance_of(const pugi::xml_node& pixels, const char* axis) {
  GivenDistance distance;
  distance.name = fmt::format("PhysicalSize{}", axis);
  distance.unit = plain_unit(pixels.attribute((distance.name + "Unit").c_str()).as_string("um"));
  if (const auto size = pixels.attribute(distance.name.c_str()))
    distance.number = foreign_number(std::string_view(size.as_string()));
  return distance;
}

OmeData data_of(const pugi::xml_node& node, const OmeImage& image) {
  OmeData data;
  data.z = count_of(node, "FirstZ").value_or(0);
  data.c = count_of(node, "FirstC").value_or(0);
  data.t = count_of(node, "FirstT").value_or(0);
  if (data.z >= image.slices || data.c >= image.channels || data.t >= image.times)
    fail("TiffData begins outside its image");
  for (const pugi::xml_node& id : children_of(node, "UUID")) {
    data.file = id.attribute("FileName").as_string();
    data.uuid = std::string(trimmed(id.text().as_string()));
  }
  const auto page = count_of(node, "IFD");
  data.page = page.value_or(0);
  data.count = count_of(node, "PlaneCount");
  if (!data.count) data.count = count_of(node, "NumPlanes");  // its name before 2008
  if (!data.count && page) data.count = 1;
  return data;
}

void check_order(const std::string& order) {
  std::string axes = order.size() == 5 && order.starts_with("XY") ? order.substr(2) : "";
  std::ranges::sort(axes);
  if (axes != "CTZ") fail(fmt::format("DimensionOrder is {}", tagrid::quoted(std::string_view(order))));
}

OmeImage image_of(const pugi::xml_node& node) {
  OmeImage image;
  image.name = node.attribute("Name").as_string();
  const auto all = children_of(node, "Pixels");
  if (all.size() != 1) fail("an image does not have one element Pixels");
  const pugi::xml_node& pixels = all.front();
  image.slices = count_of(pixels, "SizeZ").value_or(1);
  image.channels = count_of(pixels, "SizeC").value_or(1);
  image.times = count_of(pixels, "SizeT").value_or(1);
  // Planes are pages of files: not more than can be in a text of them.
  constexpr std::int64_t most = std::int64_t{1} << 20;
  if (image.slices < 1 || image.channels < 1 || image.times < 1 || image.channels > most ||
      image.times > most || image.slices > most || image.slices * image.channels > most ||
      image.slices * image.channels * image.times > most)
    fail(fmt::format("an image has {} slices, {} channels and {} moments", image.slices, image.channels,
                     image.times));
  const auto width = count_of(pixels, "SizeX"), height = count_of(pixels, "SizeY");
  if (width && height) image.size = fmt::format("{} x {}", *width, *height);
  image.type = pixels.attribute("Type").as_string();
  image.order = pixels.attribute("DimensionOrder").as_string("XYZCT");
  check_order(image.order);
  image.geometry = spacing_of(
      {{distance_of(pixels, "X"), distance_of(pixels, "Y"), distance_of(pixels, "Z")}}, image.remarks);
  for (const pugi::xml_node& data : children_of(pixels, "TiffData"))
    image.data.push_back(data_of(data, image));
  return image;
}

/// Annotations may split an axis into two, such as slices into slices and angles.
bool has_modulo(const pugi::xml_node& root) {
  return !root.find_node([](const pugi::xml_node& node) {
                return has_name(node, "ModuloAlongZ") || has_name(node, "ModuloAlongC") ||
                       has_name(node, "ModuloAlongT");
              })
              .empty();
}

}  // namespace

std::optional<OmeXml> ome_xml_of(std::string_view text) {
  if (text.find("<OME") == text.npos && text.find(":OME") == text.npos) return std::nullopt;
  pugi::xml_document document;
  if (const auto result = document.load_buffer(text.data(), text.size()); !result)
    fail(fmt::format("{} at byte {}", result.description(), result.offset));
  const pugi::xml_node root = document.document_element();
  if (!has_name(root, "OME")) return std::nullopt;
  OmeXml xml;
  xml.uuid = root.attribute("UUID").as_string();
  for (const pugi::xml_node& elsewhere : children_of(root, "BinaryOnly")) {
    xml.metadata_file = elsewhere.attribute("MetadataFile").as_string();
    if (xml.metadata_file.empty()) fail("BinaryOnly names no MetadataFile");
  }
  for (const pugi::xml_node& image : children_of(root, "Image")) xml.images.push_back(image_of(image));
  if (xml.images.empty() && xml.metadata_file.empty()) return std::nullopt;
  if (has_modulo(root))
    for (OmeImage& image : xml.images)
      image.remarks.miss("OME-XML splits an axis of its images in two (Modulo), which is not read");
  return xml;
}

std::vector<OmePlane> planes_of(const OmeImage& image,
                                const std::function<std::int64_t(const OmeData&)>& pages_of) {
  std::vector<OmePlane> planes(static_cast<std::size_t>(image.slices * image.channels * image.times));
  constexpr std::size_t most_times = 4;
  std::size_t placed = 0;
  for (const OmeData& data : image.data) {
    std::int64_t z = data.z, c = data.c, t = data.t;
    // To the plane of the next page; false after the last one.
    const auto next = [&] {
      for (const char axis : image.order.substr(2)) {
        std::int64_t& at = axis == 'Z' ? z : axis == 'C' ? c : t;
        if (++at < (axis == 'Z' ? image.slices : axis == 'C' ? image.channels : image.times)) return true;
        at = 0;
      }
      return false;
    };
    const std::int64_t count = data.count ? *data.count : pages_of(data);
    bool is_there = true;
    for (std::int64_t i = 0; i < count && is_there; ++i) {
      OmePlane& plane = planes[static_cast<std::size_t>(z + image.slices * (c + image.channels * t))];
      const OmePlane found{&data, data.page + i};
      if (plane.data != nullptr && (plane.data->file != data.file || plane.page != found.page))
        fail(fmt::format("slice {} of channel {} and moment {} is in two places", z + 1, c + 1, t + 1));
      plane = found;
      // A short text must not keep the reader busy for hours.
      if (++placed > most_times * planes.size()) fail("TiffData gives the same planes again and again");
      is_there = next();
    }
  }
  return planes;
}

std::string uuid_of_ome(std::string_view text) {
  std::size_t root = text.find("<OME");
  if (root == text.npos) root = text.find(":OME");
  if (root == text.npos) return "";
  const std::string_view element = text.substr(root, text.find('>', root) - root);
  const std::size_t name = element.find("UUID=");
  if (name == element.npos || name + 6 >= element.size()) return "";
  const std::string_view value = element.substr(name + 5);
  const std::size_t end = value.find(value.front(), 1);
  return end == value.npos ? "" : std::string(value.substr(1, end - 1));
}

}  // namespace tagrid
