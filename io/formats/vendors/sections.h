// Texts of sections, names and values, as many scanners' programs write them.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"

namespace tagrid {

/// Values by "section/name", in lower case, without blanks around them. Sections belong to groups
/// ("{volume1}"), whose names are left out; of several volumes, all but the first one are. If a name occurs
/// twice in sections with the same name, the first one counts.
using Sections = std::map<std::string, std::string>;

/// Lines that are neither a section nor a name and a value are passed over. Safe for any bytes.
Sections parse_sections(std::string_view text);

/// The names of the groups that are volumes: "volume1", "volume2".
std::vector<std::string> volumes_in(std::string_view text);

/// The text of an entire file. Throws BrokenInput if it is larger than 1 MiB, and WorldError.
std::string read_description(FileBytes& file);

/// parse_sections() of an entire file. Throws as above.
Sections read_sections(FileBytes& file);

/// The value of a field. Throws BrokenInput, with the name of the file, if it does not exist.
const std::string& required(const Sections& sections, const std::string& key, const std::string& file);

}  // namespace tagrid
