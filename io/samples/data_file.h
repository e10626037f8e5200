// Files of samples that a header names.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "io/files/file_bytes.h"

namespace tagrid {

/// The path of a file that a header names: relative to the folder of the header ("-": the current folder).
std::string path_of_data_file(const std::string& header_path, const std::string& data_file);

/// Opens the file at `path`, which a header calls `data_file`. A header is untrusted input: the file must be a regular
/// one, because anything else could interact with this process or block it: the standard input, a pipe, or a device.
/// `header_name` and `format` ("NRRD") are for messages. Throws BrokenInput and WorldError.
std::unique_ptr<FileBytes> open_data_file(const std::string& path, const std::string& data_file,
                                          const std::string& header_name, std::string_view format);

}  // namespace tagrid
