#include "io/formats/hdf5/reader/unread.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/formats/axes/geometry_words.h"
#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/links.h"

namespace tagrid {
namespace {

/// Attributes of a group say little about data sets far below it.
constexpr int most_groups = 8;
constexpr hssize_t most_numbers = 16;
constexpr std::size_t most_beside = 1000;

std::vector<std::string> names_of_links(hid_t group) {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5L_info_t* info, void* user) -> herr_t {
    auto& all = *static_cast<std::vector<std::string>*>(user);
    if (info->type == H5L_TYPE_HARD) all.emplace_back(name);
    return all.size() < most_beside ? 0 : 1;
  };
  H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names);
  return names;
}

bool is_short_list(hid_t group, const std::string& name) {
  const Hdf5Handle object(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
  if (H5Iget_type(object.get()) != H5I_DATASET) return false;
  const Hdf5Handle space(H5Dget_space(object.get()), H5Sclose);
  const hssize_t count = space ? H5Sget_simple_extent_npoints(space.get()) : 0;
  return count > 0 && count <= most_numbers;
}

}  // namespace

std::vector<std::string> unread_geometry(hid_t file, const std::string& name,
                                         const std::vector<std::string>& known) {
  std::vector<std::string> found;
  const auto is_unread = [&](const std::string& one) {
    return looks_like_geometry(one) && std::ranges::find(known, one) == known.end();
  };
  const auto look = [&](hid_t object, const std::string& where) {
    for (const std::string& one : attribute_names(object))
      if (is_unread(one) && !attribute_in_words(object, one).empty())
        found.push_back(where.empty() ? one : fmt::format("{} (of {})", one, where));
  };
  const Hdf5Handle dataset(H5Oopen(file, name.c_str(), H5P_DEFAULT), H5Oclose);
  look(dataset.get(), "");
  std::string path = name;
  for (int i = 0; i < most_groups && path != "/"; ++i) {
    const auto [group_path, own] = group_and_name(path);
    const Hdf5Handle group(H5Oopen(file, group_path.c_str(), H5P_DEFAULT), H5Oclose);
    look(group.get(), group_path);
    if (i == 0)
      for (const std::string& one : names_of_links(group.get()))
        if (one != own && is_unread(one) && is_short_list(group.get(), one))
          found.push_back(inside(group_path, one));
    path = group_path;
  }
  return found;
}

}  // namespace tagrid
