// A hidden directory for files that get their names together.
#pragma once

#include <string>
#include <vector>

#include "io/files/system_call.h"

namespace tagrid {

/// A `.NAME.part*` in a directory, until remove(). The destructor, or a signal that ends the program, removes
/// it and its files; after a crash, remove_abandoned_folders() does. Folders that were created for it are
/// removed too, if they are empty and keep() was not called. Every failure is a WorldError that names a
/// folder.
class StagingFolder {
 public:
  /// Creates `folder` and its parents if they do not exist. Throws UsageError if something else has
  /// this name.
  StagingFolder(std::string folder, const std::string& name);
  ~StagingFolder();

  const std::string& path() const { return path_; }
  /// All folders that were made, each after those around it.
  const std::vector<std::string>& made() const { return made_; }
  /// Makes another directory.
  void make(const std::string& folder);
  /// From now on, made folders stay.
  void keep() { kept_ = true; }
  /// Removes the hidden directory. `files` are all that may be in it. Returns false if it cannot be removed.
  bool remove(const std::vector<std::string>& files);

 private:
  bool make_hidden(const std::string& candidate);
  void let_go();

  std::string folder_, path_;
  std::vector<std::string> made_;
  int slot_ = -1;
  Descriptor descriptor_;
  bool kept_ = false;
};

}  // namespace tagrid
