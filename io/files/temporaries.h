// Temporary files: their names; a list of the existing ones for a signal handler that ends the program; and
// those that killed runs leave beside their outputs, which no running process holds any more. These are found
// only on local file systems: on network file systems, a lock may be visible on one machine only, or may
// forbid reading.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// Remembers the name of a temporary file; returns its slot, for forget_temporary(). If too many files are
/// registered, signal handlers do not know the rest; everything else works. With `original`: `path` is the
/// older file of that name, which gets its name back.
int register_temporary(const std::string& path, const std::string& original = "");
void forget_temporary(int slot);
/// The same for a directory, which is removed with all its files. With `outermost`: then the directories
/// around it are removed, too, up to this one, as far as they are empty.
int register_temporary_folder(const std::string& path, const std::string& outermost = "");

/// Six random letters that make a name unique.
std::string random_suffix();
/// New hidden names: `.NAME.part` and a suffix for a file that will be called `name`, and `.NAME.old` and a
/// suffix for the file that had this name before. NAME is the beginning of `name`, which may be as long as
/// names can be.
std::string temporary_name(const std::string& name);
std::string older_name(const std::string& name);
/// The hidden path beside an output, `.NAME` and this ending.
std::string hidden_beside(const std::string& output, std::string_view ending);
/// NAME, if temporary_name() may have made the name; otherwise nothing.
std::optional<std::string_view> target_of_temporary(std::string_view name);
std::optional<std::string_view> target_of_older(std::string_view name);

/// Removes registered temporary files and gives older files their names back. Async-signal-safe.
void unlink_temporaries() noexcept;

/// While one of these exists, a signal that ends the program waits: it does so with the destructor.
class SignalsWait {
 public:
  SignalsWait();
  ~SignalsWait();
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;
};
/// For a signal handler: true if it must return, as the signal waits.
bool signal_waits(int number) noexcept;

/// From now on, a run that a signal ends can be continued; it then ends with exit code `code` instead, and
/// with `message` ("" for none), of at most 200 bytes.
void end_signals_with(int code, const std::string& message);
/// That code, or -1. For a signal handler, which then writes the message.
int code_after_signal() noexcept;
void write_message_after_signal() noexcept;

/// Holds a new temporary file until its descriptor is closed. Returns false if another process has just taken
/// it for abandoned and removed it; the caller must then create another one.
bool hold_temporary(int descriptor);

/// Removes the files with a temporary_name() beside each of `outputs` that would have become that output and
/// that no process holds. Searches each directory once. Returns the number of removed files.
std::size_t remove_abandoned_files(const std::vector<std::string>& outputs);
/// The same for hidden directories; see StagingFolder. Older files in them are left.
std::size_t remove_abandoned_folders(const std::vector<std::string>& outputs);

}  // namespace tagrid
