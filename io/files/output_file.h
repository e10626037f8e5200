// Files that appear under their name only when they are complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/files/byte_sink.h"
#include "io/files/file_attributes.h"

namespace tagrid {

/// What an OutputFile is like before and after it gets its name.
struct OutputFileOptions {
  /// Whose permissions and times it gets; those of any new file without.
  std::optional<FileAttributes> like = std::nullopt;
  /// temporary() is open to other processes of this user until sync(), whatever the permissions of `like`
  /// are.
  bool others_write = false;
  /// The folder of temporary(), on the file system of the target; the target's own where it is empty.
  std::string temporaries = "";
};

/// A file in the making: a temporary `.NAME.part*` beside its target until commit(). Without a commit the
/// destructor removes it, and an older file of that name is as it was. Every failure is a WorldError that
/// names the file.
class OutputFile : public ByteSink {
 public:
  /// Begins a file that will be `path`, or writes straight to the standard output for "-", and to devices and
  /// pipes. Throws UsageError if `path` exists and `overwrite` is false, or is a folder.
  OutputFile(const std::string& path, bool overwrite, OutputFileOptions options = {});
  ~OutputFile() override;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Writes all of `bytes` at the end.
  void write(std::span<const std::byte> bytes) override;
  void write(std::string_view text) { write(std::as_bytes(std::span(text.data(), text.size()))); }
  /// Overwrites bytes that were written before, or leaves a gap. REQUIRES: can_seek().
  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// Whether it is a regular file, and not yet published.
  bool can_seek() const { return !temporary_.empty(); }
  /// Bytes written at the end so far.
  std::uint64_t position() const { return position_; }
  /// For messages: the path, or "standard output".
  const std::string& name() const { return name_; }

  /// Makes what was written durable: that it was written is certain only after this.
  void sync();
  /// The first half of commit(), for files that have to appear together: makes the file durable and gives it
  /// its name. Without keep() the destructor takes that back. Throws UsageError if the name was taken in the
  /// meantime and `overwrite` is false.
  void publish();
  /// The second half: lets go of an older file of that name. REQUIRES: publish().
  void keep();
  void commit() {
    publish();
    keep();
  }
  /// Where what was written is until publish(); "" where it is gone already, as on the standard output.
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
  std::string temporary_;  ///< Empty where there is none, or no longer.
  std::string older_;      ///< The file that had the name before, until keep(); empty where there is none.
  int slot_ = -1;          ///< Where `temporary_` is registered, or the name while it may be taken back.
  int older_slot_ = -1;    ///< Where `older_` is registered.
  int descriptor_ = -1;
  bool overwrite_ = false;
  bool synced_ = false;
  bool published_ = false;  ///< Has its name, and may lose it again.
  OutputFileOptions options_;
  std::uint64_t position_ = 0;
};

/// Throws UsageError if writing to `path` would destroy something, as OutputFile's constructor does.
void check_output(const std::string& path, bool overwrite);

/// Makes the names in a folder survive a crash of the machine. Returns 0 or an errno; that folders cannot be
/// opened or synced, as on some file systems, is no failure.
int sync_folder(const std::string& folder);

}  // namespace tagrid
