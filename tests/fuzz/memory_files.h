// Files and pipes that hold given bytes, most of them without a disk.
#pragma once

#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tagrid::fuzz {

/// Has a path as long as it exists.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {
    if (number < 0) throw std::runtime_error("no file in memory");
  }
  ~Descriptor() { close(number_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }
  std::string path() const { return "/proc/self/fd/" + std::to_string(number_); }

 private:
  int number_;
};

inline void write_all(int descriptor, std::span<const std::uint8_t> bytes) {
  if (write(descriptor, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("cannot write to memory");
}

/// A file that can seek.
class MemoryFile : public Descriptor {
 public:
  explicit MemoryFile(std::span<const std::uint8_t> bytes) : Descriptor(memfd_create("tagrid", MFD_CLOEXEC)) {
    write_all(number(), bytes);
  }
};

inline constexpr std::size_t pipe_holds = 65536;

/// A pipe that ends after `bytes`. REQUIRES: at most pipe_holds bytes.
class MemoryPipe : public Descriptor {
 public:
  explicit MemoryPipe(std::span<const std::uint8_t> bytes) : Descriptor(filled(bytes)) {}

 private:
  static int filled(std::span<const std::uint8_t> bytes) {
    int ends[2];
    if (pipe(ends) != 0) return -1;
    write_all(ends[1], bytes);
    close(ends[1]);
    return ends[0];
  }
};

/// A directory for temporary files, removed at the end of the process.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "tagrid-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create " + name);
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string write(const char* name, std::string_view bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return (path_ / name).string();
  }
  /// A name in the directory under which all written bytes are dropped.
  std::string null_named(const char* name) const {
    std::error_code exists;
    std::filesystem::create_symlink("/dev/null", path_ / name, exists);
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

}  // namespace tagrid::fuzz
