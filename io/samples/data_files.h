// Files of samples that a header names. A header is untrusted input.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"

namespace tagrid {

/// True for a name such as `\\host\share\file` or `\??\UNC\…`: Windows gives the user's name and a hash of the
/// password to such a server, so no scan may choose it.
bool is_on_server(std::string_view file);

/// The path of a file that a header names: relative to the folder of the header ("-": the current folder). Throws
/// BrokenInput on Windows if it is on a server.
std::string path_of_data_file(const std::string& header_path, const std::string& data_file);

/// Checks that the files at `data_paths` are in the folder of the header or below it. Otherwise, a
/// header from somebody else could copy any file of this machine into a .tag file. Links are
/// followed; if the header is a link, the folder of its target is also accepted. Throws BrokenInput
/// (Problem::data_outside) for the first file that is elsewhere; with `outside_ok`, adds a warning
/// that names this file instead. Only regular files are checked; open_data_file() refuses others.
void require_inside(const std::string& header_path, const std::vector<std::string>& data_paths,
                    bool outside_ok, std::vector<std::string>& warnings);

/// Opens the file at `path`, which a header calls `data_file`. It must be a regular file, because anything
/// else could interact with this process or block it: the standard input, a pipe, or a device. `header_name`
/// and `format` ("NRRD") are for messages. Throws BrokenInput and WorldError.
std::unique_ptr<FileBytes> open_data_file(const std::string& path, const std::string& data_file,
                                          const std::string& header_name, std::string_view format);

}  // namespace tagrid
