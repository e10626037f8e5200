// Temporary files: their names, and which of them exist, for a signal handler that ends the program.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tagrid {

/// Remembers the name of a temporary file; returns where, for forget_temporary(). A file beyond some number
/// is not known to a signal handler, and works otherwise. With `original`: `path` is the older file of that
/// name, which gets it back.
int register_temporary(const std::string& path, const std::string& original = "");
void forget_temporary(int slot);
/// The same of a folder of files, which goes with all that is in it.
int register_temporary_folder(const std::string& path);

/// Six letters that make a name another one.
std::string random_suffix();
/// New hidden names for a file that will be called `name`, `.NAME.part` and a suffix, and for the one that
/// was called so before, `.NAME.old` and a suffix. NAME is the beginning of `name`, which may be as long as
/// names can be.
std::string temporary_name(const std::string& name);
std::string older_name(const std::string& name);
std::string name_in_temporary_names(const std::string& name);
/// NAME of a name that temporary_name() may have made; nothing of any other.
std::optional<std::string_view> target_of_temporary(std::string_view name);
std::optional<std::string_view> target_of_older(std::string_view name);

/// Removes every temporary that is registered, and gives older files their names back. Async-signal-safe: for
/// a signal handler that ends the program.
void unlink_temporaries() noexcept;

/// Removes the files of a folder, and the folder. Async-signal-safe. What cannot be removed is left.
void remove_folder(const char* path) noexcept;

/// From now on the program can be continued where a signal ends it; it then ends with exit code `code`
/// instead. `message` ("" for none) tells that. At most 200 bytes.
void end_signals_with(int code, const std::string& message);
/// That code, or -1: for a signal handler, which then writes the message.
int code_after_signal() noexcept;
void write_message_after_signal() noexcept;

}  // namespace tagrid
