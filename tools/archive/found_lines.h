// What a search reports about volumes: lines of a list, each with an output of its own.
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>

#include "io/errors/errors.h"
#include "tools/archive/find_volumes.h"

namespace tagrid {

class FoundLines {
 public:
  FoundLines(std::filesystem::path root, const std::function<void(const FoundVolume&)>& use)
      : root_(std::move(root)), use_(use) {}

  /// A volume that can be read with these options. `text` describes it.
  void give(const std::filesystem::path& path, const OptionTexts& options, const std::string& text);
  /// The path looks like a volume and cannot be read. The same error is reported once.
  void give_broken(const std::filesystem::path& path, const OptionTexts& options, const Error& error);
  /// The number of reported errors.
  std::size_t broken() const { return broken_.size(); }

 private:
  /// Follows from the path and the options. If a volume that was found before has this name, a checksum of
  /// both is added.
  std::string output_of(const std::filesystem::path& path, const OptionTexts& options);

  std::filesystem::path root_;
  const std::function<void(const FoundVolume&)>& use_;
  std::set<std::string> taken_;   // outputs
  std::set<std::string> broken_;  // what is wrong with something, in words
};

/// True for a file that lists the images of a disk.
bool is_directory_of_dicom(const std::filesystem::path& path);

}  // namespace tagrid
