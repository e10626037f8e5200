// The names of convert's outputs: paths below one folder that never lead out of it.
#pragma once

#include <string>

namespace tagrid {

/// The output for output=NAME: a path below the folder of the outputs, without "." and empty steps, and with
/// .tag at its end. Throws UsageError if the name is absolute, contains "..", names a folder, or leads
/// through a folder with the name of a file of records.
std::string output_called(const std::string& name);

/// The output that keeps the folders of `listed`, a path of the list: 2019/knee.tag for 2019/knee.nhdr, and
/// 2019/1.2.3.tag for the folder 2019/1.2.3. Throws UsageError if the path is absolute or contains "..".
std::string output_mirroring(const std::string& listed, bool is_folder);

/// Throws UsageError if a folder of `output` below `root` is a symbolic link or not a folder: outputs would
/// leave `root`, or have a second name there. Folders may be missing.
void require_own_folders(const std::string& root, const std::string& output);

/// Creates the missing folders of `output` below `root`. They are durable when it returns. Throws as
/// require_own_folders() does, and WorldError.
void make_own_folders(const std::string& root, const std::string& output);

}  // namespace tagrid
