// Files that are written: in order, under their names only when they are complete; or at any position.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/files/byte_sink.h"
#include "io/files/file_attributes.h"
#include "io/system/files.h"

namespace tagrid {

/// Properties of an OutputFile before and after it gets its name.
struct OutputFileOptions {
  /// The file whose permissions and times it gets; without it, those of any new file.
  std::optional<FileAttributes> like = std::nullopt;
  /// Other processes of this user can open temporary() until sync(), whatever the permissions of `like` are.
  bool others_write = false;
  /// The directory of temporary(), on the file system of the target; if empty, the target's own directory.
  std::string temporaries = "";
};

/// A file that is being made: until commit() it is a temporary `.NAME.part*` beside its target. Without a
/// commit, the destructor removes it, and an older file of that name stays as it was. Every failure is a
/// WorldError that names the file.
class OutputFile : public ByteSink {
 public:
  /// Begins a file that will be `path`. For "-", devices and pipes, it writes straight to them. Throws
  /// UsageError if `path` exists and `overwrite` is false, or if it is a directory.
  OutputFile(const std::string& path, bool overwrite, OutputFileOptions options = {});
  ~OutputFile() override;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends all of `bytes`.
  void write(std::span<const std::byte> bytes) override;
  void write(std::string_view text) { write(std::as_bytes(std::span(text.data(), text.size()))); }
  /// Overwrites bytes that were written before, or leaves a gap. REQUIRES: can_seek().
  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// True if it is a regular file that is not yet published.
  bool can_seek() const { return !temporary_.empty(); }
  /// Number of bytes appended so far.
  std::uint64_t position() const { return position_; }
  /// For messages: the path, or "standard output".
  const std::string& name() const { return name_; }

  /// Makes the written bytes durable: only after this is it certain that they were written.
  void sync();
  /// The first half of commit(), for files that must appear together: makes the file durable and gives it its
  /// name. Without keep(), the destructor takes the name back. Throws UsageError if the name was taken in the
  /// meantime and `overwrite` is false.
  void publish();
  /// The second half: removes an older file of that name. REQUIRES: publish().
  void keep();
  void commit() {
    publish();
    keep();
  }
  /// The path of the written bytes until publish(); "" if there is none, as for standard output.
  const std::string& temporary() const { return temporary_; }

 private:
  void create_temporary();
  std::string hidden_path(const std::string& name) const;
  void close_descriptor();
  void set_older_aside();
  void give_name();
  void take_back() noexcept;

  std::string path_;
  std::string name_;
  std::string temporary_;  ///< Empty if there is none (any more).
  std::string older_;      ///< The older file of that name, until keep(); empty if there is none.
  int slot_ = -1;          ///< Where `temporary_` is registered; later the name, while it may be taken back.
  int older_slot_ = -1;    ///< Where `older_` is registered.
  int descriptor_ = -1;
  bool overwrite_ = false;
  bool synced_ = false;
  bool published_ = false;  ///< It has its name, and may lose it again.
  OutputFileOptions options_;
  std::uint64_t position_ = 0;
};

/// Throws UsageError if writing to `path` would destroy something, as OutputFile's constructor does.
void check_output(const std::string& path, bool overwrite);

/// A file that is written at any position. Every failure is a WorldError that names `name`.
class PlacedFile {
 public:
  /// The file exists, or is made if it `is_new`.
  PlacedFile(const std::string& path, std::string name, bool is_new = false);

  void resize(std::uint64_t size);
  void set_attributes(const FileAttributes& attributes);
  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// Makes the written bytes durable and closes the file: only then is it certain that they are there.
  void finish();

 private:
  std::string name_;
  Descriptor descriptor_;
};

}  // namespace tagrid
