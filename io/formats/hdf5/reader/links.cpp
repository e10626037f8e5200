#include "io/formats/hdf5/reader/links.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <system_error>
#include <unordered_set>
#include <utility>
#include <vector>

#include "io/formats/hdf5/handle.h"
#include "io/programs/serve.h"
#include "io/samples/data_files.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// The link of this name in a group, which is at `path`; nothing if it is a hard one, or cannot be read.
std::optional<FoundLink> link_at(hid_t group, const std::string& path, const std::string& name,
                                 std::string& value) {
  H5L_info_t info = {};
  if (H5Lget_info(group, name.c_str(), &info, H5P_DEFAULT) < 0 || info.type == H5L_TYPE_HARD)
    return std::nullopt;
  FoundLink link = {inside(path, name), "something of an unknown kind"};
  std::vector<char> bytes(info.u.val_size + 1);
  if (H5Lget_val(group, name.c_str(), bytes.data(), info.u.val_size, H5P_DEFAULT) < 0) return link;
  const char *file = nullptr, *object = nullptr;
  if (info.type == H5L_TYPE_SOFT) {
    value = bytes.data();
    link.target = value;
  } else if (info.type == H5L_TYPE_EXTERNAL &&
             H5Lunpack_elink_val(bytes.data(), info.u.val_size, nullptr, &file, &object) >= 0) {
    link.target = fmt::format("{} in the file {}", object, file);
    link.file = file;
    link.is_external = true;
  }
  return link;
}

/// Why a file that a link names is not read although it exists; "" if there is no such reason. The
/// sandbox hides the content of such a file, but not that it exists.
std::string why_not_read(hid_t file, const std::string& named) {
  if (named.empty()) return "";
  if (is_on_server(named))
    return "is named like a file on a server, so it is not read; give that file itself";
  std::string own(static_cast<std::size_t>(std::max<ssize_t>(H5Fget_name(file, nullptr, 0), 0)), '\0');
  H5Fget_name(file, own.data(), own.size() + 1);
  const fs::path folder = absolute_path(path_of(own)).parent_path(),
                 target = path_of(path_in(text_of(folder), named));
  std::error_code unknown;
  if (!fs::is_regular_file(target, unknown)) return "";
  if (!fs::equivalent(target.parent_path(), folder, unknown))
    return "is in another directory, so it is not read; give that file itself";
  const std::string name = text_of(target.filename());
  if (name.starts_with('.')) return "is hidden, so it is not read; give that file itself";
  if (!may_be_linked_to(name_of_path(own), name))
    return "does not have the name of an HDF5 file, so it is not read; give that file itself, or let its "
           "name end in .h5";
  return "";
}

struct Waiting {
  haddr_t address;
  std::string path;
};

/// The objects and links of one group; deeper objects become `waiting`, the first one last.
class GroupVisit {
 public:
  GroupVisit(const std::string& path, Visitor& visitor) : path_(path), visitor_(visitor) {}

  void run(hid_t group, std::vector<Waiting>& waiting) {
    const auto look = [](hid_t where, const char* name, const H5L_info_t* info, void* self) -> herr_t {
      static_cast<GroupVisit*>(self)->look_at(where, name, *info);
      return 0;
    };
    H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, look, this);
    waiting.insert(waiting.end(), found_.rbegin(), found_.rend());
  }

 private:
  void look_at(hid_t group, const char* name, const H5L_info_t& info) {
    if (info.type != H5L_TYPE_HARD) {
      std::string value;
      if (const auto link = link_at(group, path_, name, value)) visitor_.link(*link);
      return;
    }
    const Hdf5Handle object = object_at(group, name);
    if (const auto address = address_of(object.get())) found_.push_back({*address, inside(path_, name)});
  }

  const std::string& path_;
  Visitor& visitor_;
  std::vector<Waiting> found_ = {};
};

/// `passed`: the links that led here, in a circle if one is met again.
std::string why_missing_after(std::vector<std::string>& passed, hid_t file, const std::string& path) {
  std::string part = "/";
  for (const std::string_view step : split(path, '/')) {
    if (step.empty()) continue;
    const std::string name(step);
    const std::string group_path = std::exchange(part, inside(part, name));
    if (has_object(file, part)) continue;
    if (!has_link(file, part)) return fmt::format("there is no {}", part);
    const Hdf5Handle group = object_at(file, group_path);
    std::string value;
    const auto link = link_at(group.get(), group_path, name, value);
    if (!link) return fmt::format("{} cannot be opened", part);
    if (std::ranges::count(passed, part) > 0) return "";
    passed.push_back(part);
    if (const std::string why = why_not_read(file, link->file); !why.empty())
      return fmt::format("{} is a link to {}, which {}", part, link->target, why);
    std::string deeper = value.empty() ? "" : why_missing_after(passed, file, inside(group_path, value));
    // A link to a link: the target of the last one is more useful.
    if (deeper.starts_with("there is no ")) deeper.clear();
    return fmt::format("{} is a link to {}, which does not exist{}{}", part, link->target,
                       deeper.empty() ? "" : ": ", deeper);
  }
  return "";
}

/// How links in a path are followed: to other files, but to none on a server.
hid_t followed_links() {
  static const hid_t access = [] {
    const hid_t made = H5Pcreate(H5P_LINK_ACCESS);
    const auto refuse_servers = [](const char*, const char*, const char* file, const char*, unsigned*, hid_t,
                                   void*) -> herr_t { return is_on_server(file) ? -1 : 0; };
    H5Pset_elink_cb(made, refuse_servers, nullptr);
    return made;
  }();
  return access;
}

}  // namespace

std::vector<std::string> files_of_virtual(hid_t properties) {
  std::size_t count = 0;
  if (H5Pget_layout(properties) == H5D_VIRTUAL) H5Pget_virtual_count(properties, &count);
  std::vector<std::string> files;
  for (std::size_t i = 0; i < count; ++i) {
    const ssize_t size = H5Pget_virtual_filename(properties, i, nullptr, 0);
    if (size <= 0) continue;
    files.emplace_back(static_cast<std::size_t>(size), '\0');
    H5Pget_virtual_filename(properties, i, files.back().data(), files.back().size() + 1);
  }
  return files;
}

Hdf5Handle space_of(hid_t dataset) {
  const Hdf5Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  if (properties && std::ranges::any_of(files_of_virtual(properties.get()), is_on_server)) return {};
  return {H5Dget_space(dataset), H5Sclose};
}

bool has_link(hid_t where, const std::string& path) {
  return H5Lexists(where, path.c_str(), followed_links()) > 0;
}

bool has_object(hid_t where, const std::string& path) {
  return H5Oexists_by_name(where, path.c_str(), followed_links()) > 0;
}

Hdf5Handle object_at(hid_t where, const std::string& path) {
  return {H5Oopen(where, path.c_str(), followed_links()), H5Oclose};
}

bool may_be_linked_to(std::string_view own, std::string_view other) {
  constexpr std::array extensions = {".h5",  ".hdf5", ".hdf", ".he5", ".nxs", ".nx5", ".nx",    ".nc",
                                     ".nc4", ".mat",  ".ims", ".emd", ".mnc", ".cxi", ".vtkhdf"};
  const std::string extension = extension_of(other);
  return std::ranges::find(extensions, extension) != extensions.end() ||
         (!extension.empty() && extension == extension_of(own));
}

std::string inside(const std::string& group, const std::string& name) {
  if (name.starts_with('/')) return name;
  return (group.ends_with('/') ? group : group + "/") + name;
}

void visit_objects(hid_t file, Visitor& visitor) {
  std::unordered_set<haddr_t> seen;
  const Hdf5Handle root = object_at(file, "/");
  std::vector<Waiting> waiting;
  if (const auto address = address_of(root.get())) waiting.push_back({*address, "/"});
  while (!waiting.empty()) {
    const Waiting next = std::move(waiting.back());
    waiting.pop_back();
    if (!seen.insert(next.address).second) continue;
    say_working();
    const Hdf5Handle object(H5Oopen_by_addr(file, next.address), H5Oclose);
    const H5I_type_t kind = object ? H5Iget_type(object.get()) : H5I_BADID;
    if (kind == H5I_DATASET) visitor.dataset(object.get(), next.path);
    if (kind != H5I_GROUP) continue;
    visitor.group(object.get(), next.path);
    GroupVisit(next.path, visitor).run(object.get(), waiting);
  }
}

std::string why_missing(hid_t file, const std::string& path) {
  std::vector<std::string> passed;
  return why_missing_after(passed, file, path);
}

std::pair<std::string, std::string> group_and_name(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == path.npos) return {"/", path};
  return {slash == 0 ? "/" : path.substr(0, slash), path.substr(slash + 1)};
}

}  // namespace tagrid
