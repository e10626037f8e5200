// What the sources of this room for Windows share. Not for other rooms.
#pragma once

#define WIN32_LEAN_AND_MEAN
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>

#include <string>
#include <string_view>

namespace tagrid::windows {

/// Sets errno to the number of POSIX that says the same as an error of Windows. Returns false.
bool fail(DWORD error);
/// The same for the error of the last call.
inline bool fail() { return fail(GetLastError()); }

/// A path as the calls of Windows take it: absolute, and so that it may be longer than 260 letters. Empty, with
/// errno, if it can be none.
std::wstring native(std::string_view path);
/// A text in UTF-8. Half characters, which names may have, become U+FFFD.
std::string utf8(std::wstring_view wide);
/// A path of Windows as a text with slashes.
std::string text(std::wstring_view path);

/// The handle of an open file of files(), or INVALID_HANDLE_VALUE.
HANDLE handle_of(int file);

}  // namespace tagrid::windows
