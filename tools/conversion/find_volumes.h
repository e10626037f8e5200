// All volumes below a folder.
#pragma once

#include <functional>
#include <string>

#include "tools/options/encoding_options.h"

namespace tagrid {

/// A line for a list of volumes, or a file or folder that looks like a volume and cannot be read.
struct FoundVolume {
  std::string path;     ///< absolute
  OptionTexts options;  ///< that are needed to read it: {"series", "1.2.3"}
  std::string output;   ///< its place below the folder that was searched; nobody else has it
  std::string text;     ///< "512 x 512 x 300 int16, DICOM"; or what is wrong
  bool is_broken = false;
};

/// Calls use() for every volume in `root` and the folders below it, in natural order. Files that are slices of one volume
/// are found as their folder. Hidden files and folders, .tag files, and links to folders are passed over. Throws
/// WorldError if a folder cannot be read.
void find_volumes(const std::string& root, const std::function<void(const FoundVolume&)>& use);

}  // namespace tagrid
