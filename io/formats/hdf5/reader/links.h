// Links of HDF5 files, which may lead nowhere, and what a file holds.
#pragma once

#include <hdf5.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/formats/hdf5/handle.h"

namespace tagrid {

/// True if there is a link, or an object, at this path below a group or in a file; and the object, or nothing. Links in
/// a path are followed to other files, but to none on a server, so no other calls open what a path names.
bool has_link(hid_t where, const std::string& path);
bool has_object(hid_t where, const std::string& path);
Hdf5Handle object_at(hid_t where, const std::string& path);

/// The files that a virtual data set names, by its creation properties; "." is its own. May name one more than once.
std::vector<std::string> files_of_virtual(hid_t properties);

/// The space of a data set. None of a virtual one that names files on a server, which the library would open.
Hdf5Handle space_of(hid_t dataset);

/// The path of what a group calls `name`, which may be a path of its own.
std::string inside(const std::string& group, const std::string& name);

/// A link that is not a hard one: where it is, and where it leads.
struct FoundLink {
  std::string path;
  std::string target;  ///< "/raw/frames", or "/scan/frames in the file frames.h5"
  bool is_external = false;
  std::string file = {};  ///< of an external one
};

/// Is told of what a file holds. Groups come before what they hold, in the order of names.
class Visitor {
 public:
  virtual ~Visitor() = default;
  virtual void dataset(hid_t object, const std::string& path) = 0;
  virtual void group(hid_t object, const std::string& path) = 0;
  virtual void link(const FoundLink& found) = 0;
};

/// Visits each object of a file once, whatever the number of hard links to it. Also visits all other links,
/// without following them. Reports `working` meanwhile. Objects that cannot be opened are left out.
void visit_objects(hid_t file, Visitor& visitor);

/// A sentence that explains why there is no object at this absolute path, and names the target of a link that
/// leads nowhere, or to a file in another folder, from which nothing is read; "" if there is one.
std::string why_missing(hid_t file, const std::string& path);

/// True if links of a file called `own` may lead to a file called `other` in the same directory: it
/// has the same extension, or one of HDF5. The reader is confined to such files, so that a scan
/// gives no access to other files next to it.
bool may_be_linked_to(std::string_view own, std::string_view other);

/// The group in which the object at this path is, "/" if the path has none, and its own name.
std::pair<std::string, std::string> group_and_name(const std::string& path);

}  // namespace tagrid
