// A file system in memory, any call of which can fail, and whose power can be cut.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "io/system/files.h"

namespace tagrid {

/// Which calls fail.
struct CallFault {
  std::size_t at = 0;    ///< the number of the call, from 1; 0: none
  int error = EIO;       ///< its errno
  bool is_last = false;  ///< All calls from there on fail: the process is killed.
};

/// Files below /memory; all others are those of the system. Relative paths are of the system. It has no
/// symbolic links. Names and bytes are known apart: what has reached the disk by a sync, and what has not.
class MemoryFiles : public FileSystem {
 public:
  MemoryFiles();
  ~MemoryFiles() override;

  /// Makes a file, with its folders, that has reached the disk.
  void add(const std::string& path, std::string_view bytes);
  void add_folder(const std::string& path);
  /// The bytes of a file; "" if there is none.
  std::string content(const std::string& path) const;
  bool has(const std::string& path) const;
  /// The paths of all files, sorted.
  std::vector<std::string> all() const;

  /// What is there now, with what has reached the disk, for a process that has opened nothing yet.
  std::unique_ptr<MemoryFiles> copy() const;

  /// From now on, calls are counted, and fail.
  void spoil(const CallFault& fault);
  std::size_t calls() const { return calls_; }
  /// "rename /memory/a.tag": the call that failed first, or "" if none has.
  const std::string& spoilt() const { return spoilt_; }

  /// A state after the process has ended: files are closed, nothing fails any more. The power was cut: of the
  /// bytes, only those are left that were synced. Of the names in the folder number i, in the order of their
  /// paths, the last ones are left if bit i of `kept_names` is 1, otherwise those that were synced.
  void cut_power(unsigned kept_names);
  /// The process ended, and the system goes on: nothing is lost.
  void end_process();
  /// The number of folders.
  std::size_t folders() const;

  int open(const std::string& path, const Opening& how) override;
  int open_folder(const std::string& path) override;
  int open_nameless(const std::string& folder) override;
  int duplicate(int file) override;
  bool close(int file) override;
  std::ptrdiff_t read(int file, std::span<std::byte> to) override;
  std::ptrdiff_t read_at(int file, std::uint64_t position, std::span<std::byte> to) override;
  std::ptrdiff_t write(int file, std::span<const std::byte> bytes) override;
  bool write_at(int file, std::uint64_t position, std::span<const std::byte> bytes) override;
  std::int64_t position(int file) override;
  bool seek(int file, std::uint64_t position) override;
  void reads_in_order(int file) override;
  bool resize(int file, std::uint64_t size) override;
  bool sync(int file) override;
  bool status(int file, FileStatus& status) override;
  bool status(const std::string& path, bool follows_link, FileStatus& status) override;
  bool is_executable(const std::string& path) override;
  bool set_owner(int file, std::uint32_t owner) override;
  bool set_group(int file, std::uint32_t group) override;
  bool set_mode(int file, unsigned mode) override;
  bool set_mode(const std::string& path, unsigned mode) override;
  bool set_times(int file, FileTime accessed, FileTime modified) override;
  bool lock(int file, bool waits) override;
  bool is_local(int file) override;
  bool rename(const std::string& from, const std::string& to) override;
  bool rename_to_new(const std::string& from, const std::string& to) override;
  bool exchange(const std::string& a, const std::string& b) override;
  bool link(const std::string& from, const std::string& to) override;
  bool unlink(const std::string& path) override;
  bool make_folder(const std::string& path, unsigned mode) override;
  bool remove_folder(const std::string& path) override;
  bool list(const std::string& folder, std::vector<FolderEntry>& entries) override;
  bool resolve(const std::string& path, std::string& resolved) override;
  bool room(const std::string& folder, Room& room) override;

 private:
  struct Thing;
  using Names = std::map<std::string, std::shared_ptr<Thing>>;
  struct Opened;
  struct Place;

  bool fails(const char* call, const std::string& path);
  bool fails(const char* call, int file);
  std::shared_ptr<Thing> made(FileType type, unsigned mode);
  Opened* opened(int file);
  int new_number(std::shared_ptr<Thing> thing, const std::string& path);
  Place place_of(const std::string& path) const;
  bool moves(const std::string& from, const std::string& to, bool replaces);
  void write_to(Thing& thing, std::uint64_t position, std::span<const std::byte> bytes);
  void visit(const std::function<void(const std::string& path, Thing& thing)>& use) const;

  mutable std::mutex mutex_;
  std::shared_ptr<Thing> root_;
  std::map<int, Opened> opened_;
  int next_file_;
  std::uint64_t next_thing_ = 1;
  std::int64_t clock_ = 0;
  CallFault fault_;
  std::size_t calls_ = 0;
  bool counts_ = false;
  std::string spoilt_;
};

}  // namespace tagrid
