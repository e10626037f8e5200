// Paths and names of files. Outside of std::filesystem they are texts in UTF-8, whose steps are divided by '/' on every
// system.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tagrid {

inline constexpr bool is_windows = std::filesystem::path::preferred_separator == '\\';

/// The path that a text means. std::filesystem would take it for the code page of the process on Windows. Throws
/// std::system_error there if the text is not UTF-8, and UsageError for the path of a device: \\?\C:\a, \\.\COM1.
std::filesystem::path path_of(std::string_view text);
std::string text_of(const std::filesystem::path& path);

// std::filesystem has the next four, but on Windows, that of MinGW takes \\server\share, which is as absolute as a
// drive, for \server\share of the current drive.
bool is_absolute(const std::filesystem::path& path);
/// The path from a root on; "" stays so. Throws WorldError if the current directory is gone.
std::filesystem::path absolute_path(const std::filesystem::path& path);
/// Without "." and "..", by names alone: links are not followed.
std::filesystem::path normal_path(const std::filesystem::path& path);
/// What the path is called in a directory, by names alone; empty if they have different roots.
std::filesystem::path relative_path(const std::filesystem::path& path, const std::filesystem::path& folder);

/// The last part of a path.
std::string name_of_path(std::string_view path);
/// What its name ends with, from the last dot on, in small letters: ".nrrd".
std::string extension_of(std::string_view path);
/// The path of a file in a directory; `name` alone if it is absolute, or if the directory is "".
std::string path_in(std::string_view folder, std::string_view name);

/// True for a path that stays in its directory: relative, without empty parts, ".", ".." and zero bytes.
bool is_relative_name(std::string_view name);
/// True if Windows takes each part for the name of a file: no backslash, colon (of drives and streams) or other character
/// that it forbids, no dot or space at the end, which it drops, and no device, as AUX or com1.txt.
bool is_name_on_windows(std::string_view name);
/// True on Windows only if is_name_on_windows().
inline bool is_name_here(std::string_view name) { return !is_windows || is_name_on_windows(name); }
/// True for a path of others that may be opened below a directory: is_relative_name() and is_name_here().
bool is_safe_name(std::string_view name);

}  // namespace tagrid
