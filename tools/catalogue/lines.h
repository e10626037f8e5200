// What the records and events of an archive say, in its index.
#pragma once

#include <string>
#include <vector>

#include "tools/catalogue/database.h"

namespace tagrid {

/// A file of lines: records of `convert`, or events.
struct LineFileName {
  std::string name;
  bool has_events = false;
};

/// Throws UsageError if it is a link: what it leads to may be no file of this archive.
void refuse_link(const std::string& path);

/// Those of an archive, sorted by name. Throws WorldError.
std::vector<LineFileName> line_files_in(const std::string& folder);

/// Reads the lines that the files of records and events of an archive have got since they were read; all of them if one
/// of these files was changed in another way, or is gone. Adds sentences on what cannot be read to `remarks`.
void note_lines(const Database& index, const std::string& folder, std::vector<std::string>& remarks);

}  // namespace tagrid
