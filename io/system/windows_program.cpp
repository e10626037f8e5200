// What only a program does, not the library: its environment, its heap, its standard streams, its libraries.
#include <fcntl.h>
#include <io.h>
#include <malloc.h>

#include <array>
#include <cstdlib>

#include "io/system/on_windows.h"
#include "io/system/this_process.h"
// After <windows.h>, which it needs.
#include <shellapi.h>

namespace tagrid {

// Those of main() are in the code page of the process.
std::vector<std::string> arguments_of_program(int, char**) {
  int count = 0;
  wchar_t** const all = CommandLineToArgvW(GetCommandLineW(), &count);
  std::vector<std::string> arguments;
  for (int i = 1; i < count; ++i) arguments.push_back(windows::utf8(all[i]));
  LocalFree(all);
  return arguments;
}

std::vector<std::string> environment() {
  std::vector<std::string> variables;
  wchar_t* const all = GetEnvironmentStringsW();
  for (const wchar_t* one = all; one != nullptr && *one != L'\0'; one += std::wstring_view(one).size() + 1)
    // Those that begin with '=' are the current directories of drives.
    if (*one != L'=') variables.push_back(windows::utf8(one));
  if (all != nullptr) FreeEnvironmentStringsW(all);
  return variables;
}

std::string folder_for_temporaries() {
  std::array<wchar_t, MAX_PATH + 2> folder = {};
  const DWORD size = GetTempPathW(static_cast<DWORD>(folder.size()), folder.data());
  return size == 0 || size >= folder.size() ? "." : windows::text(folder.data());
}

// No file of the program becomes a standard stream: their numbers are taken. What is written is bytes, and UTF-8.
void occupy_standard_streams() {
  for (const int stream : {0, 1, 2}) _setmode(stream, _O_BINARY);
  SetConsoleOutputCP(CP_UTF8);
}

std::FILE* divert_standard_output() {
  const int output = _dup(1);
  // Programs for formats write samples there, or read them.
  for (const int stream : {0, 1}) _setmode(stream, _O_BINARY);
  if (output >= 0) _setmode(output, _O_BINARY);
  std::FILE* const file = output < 0 ? nullptr : _fdopen(output, "wb");
  if (file != nullptr) _dup2(2, 1);
  return file;
}

// The heap of Windows needs no advice.
void keep_freed_memory() {}
void give_back_freed_memory(std::uint64_t) {}
void give_back_free_memory() { _heapmin(); }

// Libraries are linked into the program.
void* load_library(const char*) { return nullptr; }
void* function_of_library(void*, const char*) { return nullptr; }

}  // namespace tagrid
