// This process: who it is, its environment, streams, memory and time, and what it learns of the machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tagrid {

/// The number of this process, as others see it.
int process_number();
std::string host_name();
/// The file of the running program; nothing if that is not known.
std::optional<std::filesystem::path> program_path();
/// The arguments that main() was given, without the name of the program, as UTF-8 where the system has letters.
std::vector<std::string> arguments_of_program(int count, char** arguments);
/// All variables, each as NAME=VALUE.
std::vector<std::string> environment();
/// The directory where the user wants temporary files that have no better place.
std::string folder_for_temporaries();

/// From now on, what is made for a fork of this process calls `action` there.
void call_after_fork(void (*action)());
/// Starts a thread that never ends, on a stack that a forked process does not use again. Returns false if
/// there is none.
bool start_lasting_thread(void* (*work)(void*), void* given);

/// Of a standard stream.
bool is_terminal(int stream);
/// Of the terminal that standard error is; npos of std::string if it is none.
std::size_t columns_of_terminal();
/// Makes sure that descriptors 0, 1 and 2 are taken, so that no file of the program becomes a standard stream
/// that the caller closed. Reading or writing such a stream fails.
void occupy_standard_streams();
/// From now on, what is written to standard output goes to standard error. Returns a stream to what standard
/// output was, or nullptr.
std::FILE* divert_standard_output();

/// How many files this process may have open, but at most 8192.
std::size_t most_open_files();
/// Fills `bytes` with numbers that nobody can guess. Returns false if the system gives none; errno says why.
bool fill_with_random(std::span<unsigned char> bytes);

/// In seconds: of this thread, and of all threads, so far.
double processor_seconds_of_thread();
double processor_seconds();
/// A time since 1970, as clocks here show it. Returns false for an impossible one.
bool to_local_time(std::time_t time, std::tm& parts);

/// The processors that this process may use, at least 1, and the bytes of memory that the machine has.
int usable_processors();
std::uint64_t memory_of_machine();

/// Bytes of memory of this process: its own, not those of files; and all of it at its peak.
std::uint64_t memory_of_this_process();
std::uint64_t peak_memory();
/// Sets up the heap for speed: memory that a brick has freed is kept for the next one.
void keep_freed_memory();
/// Sets up the heap for a limit on memory, in bytes: large blocks go back to the system when freed.
void give_back_freed_memory(std::uint64_t limit);
/// Gives all free memory back to the system, once.
void give_back_free_memory();

/// A library that is loaded when it is needed; nullptr if there is none of this name. It stays loaded.
void* load_library(const char* name);
/// A function of it; nullptr if it has none of this name.
void* function_of_library(void* library, const char* name);

/// A file whose bytes are read like memory.
class MappedFile {
 public:
  /// Throws WorldError.
  explicit MappedFile(const std::string& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  std::span<char> bytes() const { return {bytes_, size_}; }

 private:
  /// Nothing, with errno, if it cannot be mapped.
  static char* map(int file, std::size_t size);

  char* bytes_ = nullptr;
  std::size_t size_ = 0;
};

/// A file for a library, or another program, that opens files by a path. It goes with this object.
class FileForLibrary {
 public:
  /// In memory where the system has such files, otherwise in the folder for temporary files. Throws WorldError.
  FileForLibrary();
  /// A temporary file in `folder`; error messages name `whose`. Throws WorldError.
  FileForLibrary(const std::string& folder, const std::string& whose);
  ~FileForLibrary();
  FileForLibrary(const FileForLibrary&) = delete;
  FileForLibrary& operator=(const FileForLibrary&) = delete;

  /// Only this process, and those that it starts, may be able to open it.
  const std::string& path() const { return path_; }
  /// Whether the path is one of a directory, in which a library can look for it.
  static bool has_name();
  /// From now on, what is never written takes no room. Call it after the library has opened the file. Returns
  /// false where files cannot have holes.
  bool leave_holes() const;

 private:
  int open_ = -1;
  std::string path_;
};

}  // namespace tagrid
