// The files of a folder that may be parts of a volume.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// The regular files of a folder in natural order: without hidden ones and those of deeper folders. Links to
/// files count, and so do those that lead nowhere: a lost slice must not look as if it had never existed.
/// Throws WorldError.
std::vector<std::string> visible_files(const std::string& folder);

}  // namespace tagrid
