// Directories that are written: a hidden one for files that get their names together, and one that gets its
// own name with all its files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "io/files/file_attributes.h"
#include "io/files/temporaries.h"
#include "io/system/files.h"

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
  /// Removes the hidden directory. `in_it` are all that may be in it. Returns false if it cannot be removed.
  bool remove(const std::vector<std::string>& in_it);

 private:
  bool make_hidden(const std::string& candidate);
  void let_go();

  std::string folder_, path_;
  std::vector<std::string> made_;
  int slot_ = -1;
  Descriptor descriptor_;
  bool kept_ = false;
};

/// A directory of files that is being made: until commit() it is a hidden `.NAME.part*` beside its target.
/// Without a commit, the destructor removes it, and an older directory of that name stays as it was. Every
/// failure is a WorldError that names the directory.
class OutputFolder {
 public:
  /// True for an existing directory that may be replaced.
  using MayReplace = bool (*)(const std::string& folder);

  /// Begins a directory that will be `path`. Files get the permissions of `like`, and directories those that
  /// go with them. Throws UsageError if `path` exists and `overwrite` is false, or if it may not be replaced.
  OutputFolder(const std::string& path, bool overwrite, std::optional<FileAttributes> like,
               MayReplace may_replace);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// The hidden directory until publish(), for files that others make in it, and make durable.
  const std::string& hidden() const { return staging_.path(); }
  /// Begins the next file, "a/b/c": all directories around it are made. REQUIRES: no file is open.
  void begin(const std::string& file);
  /// Appends bytes to the file.
  void write(std::span<const std::byte> bytes);
  /// Makes the file durable.
  void end();
  /// Bytes of all files so far.
  std::uint64_t bytes() const { return bytes_; }
  const std::string& name() const { return name_; }

  /// As those of OutputFile: the directory gets its name, and loses it again without keep().
  void publish();
  void keep();

 private:
  enum class State { hidden, named, exchanged };
  void require_target() const;
  void sync_folders() const;
  void take_back() noexcept;

  std::string path_, name_;
  bool overwrite_;
  std::optional<FileAttributes> like_;
  MayReplace may_replace_;
  StagingFolder staging_;
  std::set<std::string> folders_ = {""};  ///< that were made, relative to it
  Descriptor file_;
  std::uint64_t position_ = 0, bytes_ = 0;
  State state_ = State::hidden;
  std::optional<SignalsWait> signals_wait_;  ///< while it may lose its name
};

}  // namespace tagrid
