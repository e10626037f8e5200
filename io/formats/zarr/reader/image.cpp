#include "io/formats/zarr/reader/image.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "io/formats/zarr/reader/json.h"
#include "io/formats/zarr/reader/n5.h"
#include "io/programs/serve.h"
#include "io/programs/serve_reader.h"
#include "io/programs/words.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// "Zarr" or "N5", for messages.
std::string_view format_of(const ZarrStore& store) {
  const auto root = zarr_node(store, "");
  return root ? (root->is_n5() ? "N5" : "Zarr") : lower_case(store.path()).ends_with(".n5") ? "N5" : "Zarr";
}

/// The limits of a search: a hostile store can have any number of nested folders.
constexpr std::size_t most_nodes = 100'000, deepest = 64;
constexpr std::size_t most_named = 3;

/// The descriptions of levels in a group, by any version of OME-Zarr; an empty list without them.
const Json& multiscales_of(const Json& attributes) {
  static const Json none = Json::array();
  for (const Json* where : {&member(attributes, "ome"), &attributes})
    if (const Json& list = member(*where, "multiscales"); list.is_array()) return list;
  return none;
}

/// The paths of levels, in the form of keys; "" for a path that is not in the store.
std::vector<std::string> levels_of(const Json& multiscale) {
  std::vector<std::string> paths;
  const Json& datasets = member(multiscale, "datasets");
  if (datasets.is_array())
    for (const Json& dataset : datasets) paths.push_back(plain_path(text_at(dataset, "path")));
  for (std::string& path : paths)
    if (!is_safe_name(path)) path.clear();
  return paths;
}

/// Reads what the description of levels says of one of them.
class Description {
 public:
  Description(std::string where, const Json& multiscale, std::size_t level, ZarrImage& image)
      : where_(std::move(where)), image_(image) {
    if (const Json& systems = member(multiscale, "coordinateSystems"); !systems.is_null())
      refuse("has coordinate systems, as versions after 0.5 have, which are not supported");
    read_axes(member(multiscale, "axes"));
    apply(member(member(multiscale, "datasets")[level], "coordinateTransformations"));
    apply(member(multiscale, "coordinateTransformations"));
    image_.name = text_at(multiscale, "name");
    image_.is_finest = level == 0;
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw BrokenInput("{}: OME-Zarr: {}", where_, why);
  }

  void read_axes(const Json& axes) {
    if (axes.is_null()) return;  // up to 0.2, axes are t, c, z, y, x
    if (!axes.is_array() || axes.size() != image_.axes.size())
      refuse(fmt::format("its axes are not the {} of {}", image_.axes.size(),
                         tagrid::quoted(image_.array.path)));
    for (std::size_t i = 0; i < axes.size(); ++i)
      image_.axes[i] = {axes[i].is_string() ? axes[i].get<std::string>() : text_at(axes[i], "name"),
                        text_at(axes[i], "unit")};
  }

  void apply(const Json& transformations) {
    if (transformations.is_null()) return;
    if (!transformations.is_array()) refuse("its coordinate transformations are no list");
    for (const Json& one : transformations) {
      const std::string type = text_at(one, "type");
      if (type == "identity") continue;
      if (type != "scale" && type != "translation")
        refuse(fmt::format(
            "has a coordinate transformation of the type {}, which is not supported; only scale and "
            "translation are",
            tagrid::quoted(type)));
      const Json& numbers = member(one, type.c_str());
      const auto is_number = [](const Json& number) {
        return number.is_number() && std::isfinite(number.get<double>());
      };
      if (!numbers.is_array() || numbers.size() != image_.axes.size() ||
          !std::ranges::all_of(numbers, is_number))
        refuse(fmt::format("the {} of {} is not a number for each axis", type,
                           tagrid::quoted(image_.array.path)));
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        ZarrAxis& axis = image_.axes[i];
        if (type == "scale") {
          axis.scale *= numbers[i].get<double>();
          axis.translation *= numbers[i].get<double>();
        } else {
          axis.translation += numbers[i].get<double>();
        }
      }
      (type == "scale" ? image_.has_scale : image_.has_translation) = true;
    }
  }

  std::string where_;
  ZarrImage& image_;
};

/// An array, with the levels that have it: of a group around it.
ZarrImage image_of(const ZarrStore& store, const ZarrNode& node) {
  ZarrImage image;
  image.array = zarr_array(store, node);
  image.metadata_key = node.metadata_key;
  image.attributes = node.attributes;
  image.axes.resize(image.array.shape.size());
  for (std::size_t i = 0; i < image.array.axis_names.size(); ++i)
    image.axes[i].name = image.array.axis_names[i];
  if (const std::size_t slash = node.path.rfind('/'); slash != std::string::npos)
    image.group = node.path.substr(0, slash);
  if (image.array.is_n5) set_n5_scale(store, image);
  for (std::size_t end = node.path.size(); end > 0;) {
    const std::size_t slash = node.path.rfind('/', end - 1);
    end = slash == std::string::npos ? 0 : slash;
    const auto group = zarr_node(store, node.path.substr(0, end));
    if (!group) continue;
    const std::string own = node.path.substr(end == 0 ? 0 : end + 1);
    for (const Json& multiscale : multiscales_of(group->attributes)) {
      const std::vector<std::string> levels = levels_of(multiscale);
      const auto level = std::ranges::find(levels, own);
      if (level == levels.end()) continue;
      const std::string key = group->is_version_2() ? joined(group->path, ".zattrs") : group->metadata_key;
      Description(joined(store.path(), key), multiscale, static_cast<std::size_t>(level - levels.begin()),
                  image);
      image.attributes = group->attributes;
      image.group = group->path;
      image.remarks.clear();
      image.doubts.clear();
      return image;
    }
    if (const Json& all = multiscales_of(group->attributes); !all.empty() && image.remarks.empty())
      image.remarks.push_back(fmt::format(
          "{}: OME-Zarr: the description of levels in {} does not name {}; the positions of its samples are "
          "unknown",
          store.path(), group->path.empty() ? "its root" : tagrid::quoted(group->path), tagrid::quoted(own)));
  }
  return image;
}

std::string in_words(const ZarrArray& array) {
  std::vector<std::int64_t> sizes(array.shape.rbegin(), array.shape.rend());
  return fmt::format("{} {}", fmt::join(sizes, " x "), array.type_name);
}

double samples_of(const ZarrArray& array) {
  return std::accumulate(array.shape.begin(), array.shape.end(), 1.0,
                         [](double product, auto size) { return product * static_cast<double>(size); });
}

/// Everything below a group that could be meant.
class Candidates {
 public:
  Candidates(const ZarrStore& store, const ZarrNode* root, const std::string& path) : store_(store) {
    if (root != nullptr && root->is_array)
      add(*root);
    else if (root == nullptr || !add_levels(*root))
      search(path, 0);
  }

  std::vector<Choice> choices;
  std::vector<std::string> others;  ///< arrays that are no volumes
  std::vector<std::string> unread;  ///< folders that cannot be listed

 private:
  void search(const std::string& path, std::size_t depth) {
    // Links may lead to a folder in many ways, and in circles.
    if (!seen_.insert(store_.identity(path)).second) return;
    if (depth == deepest) refuse(fmt::format("has directories that are nested more than {} deep", deepest));
    for (const std::string& name : folders_in(path)) {
      if (++count_ > most_nodes)
        refuse(fmt::format("has more than {} groups, arrays and directories", most_nodes));
      say_working();
      const std::string below = joined(path, name);
      const auto node = zarr_node(store_, below);
      if (node && node->is_array)
        add(*node);
      else if (!node || !add_levels(*node))
        search(below, depth + 1);
    }
  }

  [[noreturn]] void refuse(const std::string& why) const {
    throw broken_zarr(store_.path(),
                      why + ", and is not searched for volumes; choose an array with --dataset",
                      format_of(store_));
  }

  std::vector<std::string> folders_in(const std::string& path) try {
    return store_.folders(path);
  } catch (const WorldError& error) {
    unread.emplace_back(error.what());
    return {};
  }

  void add(const ZarrNode& node) {
    const ZarrArray array = zarr_array(store_, node);
    const bool is_volume = array.type && array.shape.size() >= (node.path.empty() ? 2 : 3);
    if (is_volume)
      choices.push_back({node.path, in_words(array)});
    else
      others.push_back(
          fmt::format("{} is {}", node.path.empty() ? "it" : tagrid::quoted(node.path), in_words(array)));
  }

  /// The finest level of each description in a group; false if it has none.
  bool add_levels(const ZarrNode& group) {
    bool has_any = false;
    for (const Json& multiscale : multiscales_of(group.attributes)) {
      const std::vector<std::string> levels = levels_of(multiscale);
      if (levels.empty()) continue;
      has_any = true;
      if (levels.front().empty())
        throw broken_zarr(
            store_.path(),
            fmt::format("the path of the finest level is {}, which is not inside the group",
                        tagrid::quoted(text_at(member(multiscale, "datasets").front(), "path"))));
      const std::string path = joined(group.path, levels.front());
      const auto node = levels.front().empty() ? std::nullopt : zarr_node(store_, path);
      if (!node || !node->is_array)
        throw broken_zarr(store_.path(),
                          fmt::format("the finest level is {}, which is missing",
                                      tagrid::quoted(path.empty() ? shown(multiscale) : path)));
      const ZarrArray array = zarr_array(store_, *node);
      require_finest(group, levels, array);
      if (array.type)
        choices.push_back({path, in_words(array)});
      else
        others.push_back(fmt::format("{} is {}", tagrid::quoted(path), in_words(array)));
    }
    return has_any;
  }

  /// OME-Zarr: the finest level comes first. Other levels need not be readable.
  void require_finest(const ZarrNode& group, const std::vector<std::string>& levels,
                      const ZarrArray& first) const {
    for (const std::string& level : levels) {
      if (level.empty()) continue;
      const std::string path = joined(group.path, level);
      std::optional<ZarrArray> other;
      try {
        if (const auto node = zarr_node(store_, path); node && node->is_array)
          other = zarr_array(store_, *node);
      } catch (const BrokenInput&) {
        continue;
      }
      if (other && samples_of(*other) > samples_of(first))
        throw broken_zarr(
            store_.path(),
            fmt::format("the first level, {}, should be the finest one, but {} has more samples "
                        "({}, not {}); choose one with --dataset",
                        tagrid::quoted(levels.front()), tagrid::quoted(level), in_words(*other),
                        in_words(first)));
    }
  }

  const ZarrStore& store_;
  std::size_t count_ = 0;
  std::set<std::string> seen_;
};

ZarrImage one_of(const ZarrStore& store, const Candidates& all, const std::string& wanted) {
  if (all.choices.empty())
    throw broken_zarr(
        store.path(),
        fmt::format(
            "has no array that is a volume of integers of 8, 16 or 32 bits, or floats of 32 or 64 bits{}{}",
            all.others.empty() ? "" : "; ", listed(all.others, most_named)) +
            (all.unread.empty() ? "" : "; " + listed(all.unread, most_named)),
        format_of(store));
  const std::string path = all.choices[chosen(store.path(), "dataset", wanted, all.choices)].name;
  ZarrImage image = image_of(store, *zarr_node(store, path));
  if (wanted.empty() && !all.unread.empty())
    image.remarks.push_back(fmt::format("{}: is read, because it is the only volume that was found, but: {}",
                                        joined(store.path(), path), listed(all.unread, most_named)));
  return image;
}

}  // namespace

std::array<std::optional<std::size_t>, 3> ZarrImage::space() const {
  std::array<std::optional<std::size_t>, 3> space;
  for (std::size_t i = 0; i < axes.size(); ++i)
    if (const std::string letter = lower_case(axes[i].name); letter == "x" || letter == "y" || letter == "z")
      space[static_cast<std::size_t>(letter[0] - 'x')] = i;
  const bool has_other_names = !space[0] || !space[1];
  for (std::size_t i = 0; i < 3 && has_other_names; ++i)
    space[i] = i < axes.size() ? std::optional(axes.size() - 1 - i) : std::nullopt;
  return space;
}

ZarrImage chosen_image(const ZarrStore& store, const std::string& wanted) {
  const std::string path = plain_path(wanted);
  const auto root = zarr_node(store, "");
  if (path.empty()) return one_of(store, Candidates(store, root ? &*root : nullptr, ""), "");
  const auto node = zarr_node(store, path);
  if (node && node->is_array) return image_of(store, *node);
  if (node) return one_of(store, Candidates(store, &*node, path), "");
  return one_of(store, Candidates(store, root ? &*root : nullptr, ""), wanted);
}

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
      throw broken_zarr(path,
                        fmt::format("has {} of {} along the axis {}, which is too many volumes", other.size,
                                    other.word, other.letter),
                        image.array.format());
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
