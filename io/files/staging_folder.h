// A hidden folder for files that get their names together.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// Until remove(), a `.NAME.part*` in a folder. It is removed with its files by the destructor, by a signal that ends the
/// program, and after a crash by remove_abandoned_folders(). Folders that were made are removed with it, but for keep(), as
/// far as they are empty. Every failure is a WorldError that names a folder.
class StagingFolder {
 public:
  /// Makes the folder that `folder` names, with its parents, if it is not there. Throws UsageError if there is something
  /// else.
  StagingFolder(std::string folder, const std::string& name);
  ~StagingFolder();
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;

  const std::string& path() const { return path_; }
  /// All folders that were made, each after those around it.
  const std::vector<std::string>& made() const { return made_; }
  /// Makes another folder.
  void make(const std::string& folder);
  /// From now on, made folders stay.
  void keep() { kept_ = true; }
  /// Removes the hidden folder. `files` are all that may be in it. Returns false if it cannot be removed.
  bool remove(const std::vector<std::string>& files);

 private:
  bool make_hidden(const std::string& candidate);
  void let_go();

  std::string folder_, path_;
  std::vector<std::string> made_;
  int slot_ = -1, descriptor_ = -1;
  bool kept_ = false;
};

}  // namespace tagrid
