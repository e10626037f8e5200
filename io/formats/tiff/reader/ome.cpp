#include "io/formats/tiff/reader/ome.h"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/formats/tiff/reader/tiff_volumes.h"
#include "io/programs/words.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"
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

namespace {

/// The planes of an image. `pages_of` says how many pages a file has. Throws BrokenInput if a plane is in two
/// places.
template <class PagesOf>
std::vector<OmePlane> planes_of(const OmeImage& image, PagesOf pages_of) {
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

}  // namespace

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

// The volumes of OME-TIFF files, of which several may be one set.

namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_named = 10;

std::string quoted_name(const std::string& name) { return tagrid::quoted(std::string_view(name)); }

/// A file of a set.
struct SetFile {
  std::string path;
  std::map<std::int64_t, TiffPage> pages;  ///< by the numbers of their directories
  std::set<std::int64_t> used;             ///< those that are slices
};

/// The files of a set, in the order in which they are met.
class SetOfFiles {
 public:
  SetOfFiles(const std::string& path, const std::vector<TiffPage>& pages, const OmeXml& xml, bool has_xml)
      : path_(path), own_pages_(pages), uuid_(xml.uuid), has_xml_(has_xml) {
    for (const OmeImage& image : xml.images)
      for (const OmeData& data : image.data) names_.insert(data.file);
  }

  /// The number of the file of some planes; nothing if it is missing.
  std::optional<std::size_t> number_of(const OmeData& data) {
    const std::pair key(data.file, data.uuid);
    if (const auto known = numbers_.find(key); known != numbers_.end()) return known->second;
    return numbers_[key] = is_own(data) ? own() : other(data);
  }
  SetFile& file(std::size_t number) { return files_[number]; }
  std::vector<SetFile>& files() { return files_; }
  bool has_own() const { return own_.has_value(); }
  const std::set<std::string>& missing() const { return missing_; }
  TiffRemarks& remarks() { return remarks_; }

 private:
  /// If only one file is named, it is the one with the description, which may have another name by now.
  bool is_own(const OmeData& data) const {
    if (data.file == name_of_path(path_)) return true;
    if (!has_xml_) {
      if (data.file.empty()) throw BrokenInput("TIFF file: OME-XML does not say in which file a slice is");
      return false;
    }
    if (data.file.empty()) return data.uuid.empty() || uuid_.empty() || data.uuid == uuid_;
    const bool is_other = !uuid_.empty() && !data.uuid.empty() && data.uuid != uuid_;
    if (names_.size() == 1 && !is_other) return true;
    std::error_code unknown;
    return !fs::exists(path_of(beside(path_, data.file)), unknown) && !data.uuid.empty() &&
           data.uuid == uuid_;
  }

  std::size_t own() {
    if (!own_) {
      own_ = files_.size();
      add(path_, own_pages_);
    }
    return *own_;
  }

  std::optional<std::size_t> other(const OmeData& data) {
    const std::string name = data.file.empty() ? data.uuid : data.file;
    const std::string path = beside(path_, name);
    std::error_code unknown;
    if (data.file.empty() || !fs::exists(path_of(path), unknown)) {
      missing_.insert(name);
      return std::nullopt;
    }
    say_working();
    TiffFile tiff(path);
    const std::string uuid = uuid_of_ome(tiff.description());
    std::vector<TiffPage> pages = tiff.pages();
    if (!uuid.empty() && !data.uuid.empty() && uuid != data.uuid)
      remarks_.miss(fmt::format("OME-XML means another file than the one that is called {} (by their UUIDs)",
                                quoted_name(name)));
    remarks_.add(tiff.remarks());
    add(path, pages);
    return files_.size() - 1;
  }

  void add(const std::string& path, const std::vector<TiffPage>& pages) {
    SetFile file{path, {}, {}};
    for (const TiffPage& page : pages) {
      TiffPage& kept = file.pages[page.number] = page;
      kept.description = {};
    }
    files_.push_back(std::move(file));
  }

  const std::string& path_;
  const std::vector<TiffPage>& own_pages_;
  std::string uuid_;
  bool has_xml_;
  std::set<std::string> names_, missing_;
  std::map<std::pair<std::string, std::string>, std::optional<std::size_t>> numbers_;
  std::vector<SetFile> files_;
  std::optional<std::size_t> own_;
  TiffRemarks remarks_;
};

/// What is missing, with the name of the first file that exists: the same for whichever file was named.
class MissingSlices {
 public:
  void add(const std::string& volume, std::int64_t slice) { slices_[volume].push_back(slice); }
  bool empty() const { return slices_.empty(); }

  std::string in_words(const SetOfFiles& set) const {
    if (const std::set<std::string>& files = set.missing(); !files.empty()) {
      std::vector<std::string> names(files.begin(), files.end());
      std::ranges::sort(names, comes_before);
      for (std::string& name : names) name = quoted_name(name);
      return fmt::format("OME-XML names {} that {} missing: {}",
                         files.size() == 1 ? "a file" : fmt::format("{} files", files.size()),
                         files.size() == 1 ? "is" : "are", listed(names, most_named));
    }
    const auto& [volume, slices] = *slices_.begin();
    return fmt::format("OME-XML gives no page to slice {} of {}", listed(slices, most_named),
                       volume.empty() ? "the image" : volume);
  }

 private:
  std::map<std::string, std::vector<std::int64_t>> slices_;  // by the names of their volumes
};

/// XML that describes pages that do not exist may belong to another file.
void compare(const OmeImage& image, const TiffPage& page, TiffRemarks& remarks) {
  const std::string size = fmt::format("{} x {}", page.width, page.height);
  std::string type = image.type;
  if (type == "float") type = "float32";
  if (type == "double") type = "float64";
  if (type == "bit") type = "uint8";
  if ((!image.size.empty() && image.size != size) || (!type.empty() && type != name_of(page.type)))
    remarks.miss(fmt::format("OME-XML says that pages are {} {}, but they are {}", image.size, image.type,
                             in_words(page)));
}

/// One channel at one moment. Slices without a page are left out.
TiffVolume volume_of(const OmeImage& image, std::span<const OmePlane> planes, SetOfFiles& set,
                     std::vector<std::int64_t>& missing) {
  TiffVolume volume{{}, {}, image.geometry, image.remarks};
  for (std::size_t z = 0; z < planes.size(); ++z) {
    const auto number = planes[z].data == nullptr ? std::nullopt : set.number_of(*planes[z].data);
    if (!number) {
      missing.push_back(static_cast<std::int64_t>(z) + 1);
      continue;
    }
    SetFile& file = set.file(*number);
    const auto page = file.pages.find(planes[z].page);
    if (page == file.pages.end()) {
      missing.push_back(static_cast<std::int64_t>(z) + 1);
      continue;
    }
    if (!file.used.insert(page->first).second) volume.remarks.miss("OME-XML gives one page to two slices");
    volume.planes.push_back({*number, page->second});
  }
  if (!volume.geometry.has_spacing && !volume.planes.empty())
    volume.geometry = common_spacing(volume.planes, volume.remarks, spacing_of_resolutions);
  if (!missing.empty()) {
    volume.geometry.spacing[2] = Geometry::unknown;
    volume.remarks.warn(
        fmt::format("slices that are left out, as they have no page: {}", listed(missing, most_named)));
  }
  if (!volume.planes.empty()) compare(image, volume.planes.front().page, volume.remarks);
  return volume;
}

void add_image(const OmeImage& image, std::size_t number, bool is_one_of_several, SetOfFiles& set,
               MissingSlices& missing, TiffVolumes& volumes) {
  const std::vector<OmePlane> planes = planes_of(image, [&](const OmeData& data) -> std::int64_t {
    const auto file = set.number_of(data);
    return file ? static_cast<std::int64_t>(set.file(*file).pages.size()) : 1;
  });
  const auto slices = static_cast<std::size_t>(image.slices);
  for (std::int64_t t = 0; t < image.times; ++t)
    for (std::int64_t c = 0; c < image.channels; ++c) {
      Choice choice = choice_of(c, image.channels, t, image.times);
      if (is_one_of_several) {
        choice.name = fmt::format("i{}{}", number, choice.name);
        choice.text = fmt::format("image {}{}{}", quoted_name(image.name), choice.text.empty() ? "" : ", ",
                                  choice.text);
      }
      std::vector<std::int64_t> without;
      const std::size_t first = slices * static_cast<std::size_t>(c + image.channels * t);
      TiffVolume volume = volume_of(image, std::span(planes).subspan(first, slices), set, without);
      for (const std::int64_t slice : without) missing.add(choice.text, slice);
      volume.choice = std::move(choice);
      if (!volume.planes.empty()) volumes.list.push_back(std::move(volume));
    }
}

}  // namespace

std::string beside(const std::string& path, const std::string& name) {
  if (!is_safe_name(name) || name.find('/') != name.npos)
    throw BrokenInput("{}: TIFF file: OME-XML names the file {}, which is not in its directory", path,
                      quoted_name(name));
  return text_of(path_of(path).parent_path() / path_of(name));
}

std::string file_that_names(const std::string& path) {
  const auto is_ome = [](const std::string& name) {
    return lower_case(name).ends_with(".ome.tif") || lower_case(name).ends_with(".ome.tiff");
  };
  if (!is_ome(path)) return "";
  const std::string folder = text_of(path_of(path).parent_path());
  for (const std::string& other : visible_files(folder.empty() ? "." : folder)) {
    const std::string name = name_of_path(other);
    if (!is_ome(name) || name == name_of_path(path)) continue;
    try {
      const auto xml = ome_xml_of(TiffFile(beside(path, name)).description());
      if (!xml) continue;
      for (const OmeImage& image : xml->images)
        for (const OmeData& data : image.data)
          if (data.file == name_of_path(path)) return beside(path, name);
    } catch (const Error&) {
      // It is no file of this set, or is refused when it is opened.
    }
  }
  return "";
}

void add_ome(const std::string& path, const std::vector<TiffPage>& pages, const OmeXml& xml, bool has_xml,
             bool gaps_ok, TiffVolumes& volumes) {
  SetOfFiles set(path, pages, xml, has_xml);
  MissingSlices missing;
  for (std::size_t i = 0; i < xml.images.size(); ++i)
    add_image(xml.images[i], i + 1, xml.images.size() > 1, set, missing, volumes);
  volumes.files.clear();
  std::size_t unused = 0;
  for (const SetFile& file : set.files()) {
    volumes.files.push_back(file.path);
    unused += file.pages.size() - file.used.size();
  }
  if (unused > 0)
    volumes.remarks.miss(
        fmt::format("{} pages of its files are no slices by OME-XML; they are not read", unused));
  volumes.remarks.add(set.remarks());
  if (!set.has_own())
    volumes.remarks.miss(fmt::format("OME-XML names other files than {}, which are read instead",
                                     quoted_name(name_of_path(path))));
  if (missing.empty()) return;
  const std::string& first =
      volumes.files.empty() ? path : *std::ranges::min_element(volumes.files, comes_before);
  const std::string why = fmt::format("{}: TIFF file: {}", first, missing.in_words(set));
  if (volumes.list.empty()) throw BrokenInput(why);
  if (!gaps_ok) throw BrokenInput(why, Problem::slices_missing);
  volumes.warnings.push_back(why);
}

}  // namespace tagrid
