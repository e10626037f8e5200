// Calls of the operating system that handle interruptions and partial results.
#pragma once

#include <sys/stat.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace tagrid {

class BrokenInput;

/// Makes a call, and repeats it if a signal interrupts it. Not for close(), which closes the file anyway.
template <class Call>
auto uninterrupted(Call call) {
  for (;;) {
    const auto result = call();
    if (result >= 0 || errno != EINTR) return result;
  }
}

/// An open file, which the destructor closes. It stands for its number in system calls; negative: none.
class Descriptor {
 public:
  Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    reset();
    number_ = other.release();
    return *this;
  }
  ~Descriptor() { reset(); }

  operator int() const { return number_; }
  /// The caller must close the file.
  int release() { return std::exchange(number_, -1); }
  void reset();

 private:
  int number_;
};

/// Writes all of `bytes` from `position` on, in several calls if needed. On failure, false and errno.
bool write_all_at(int descriptor, std::uint64_t position, std::span<const std::byte> bytes);

/// Locks a file for this process alone until its descriptor is closed, without waiting. Returns false on
/// failure; errno is EWOULDBLOCK if another process holds the lock.
bool lock_now(int descriptor);

/// The folder of a path: "." if the path names none.
std::string folder_of(const std::string& path);

/// The status of a file. Returns nothing if no file has this path, or if its links lead nowhere or in a
/// circle. Throws WorldError if the system cannot tell: nobody may take such a name for a free one.
std::optional<struct stat> status_of(const std::string& path);
/// The same, but of a symbolic link itself, not of the file that it leads to.
std::optional<struct stat> status_of_name(const std::string& path);

/// True for a symbolic link that leads to no file, or in a circle. Throws WorldError if the system cannot tell.
bool is_dead_link(const std::string& path);
/// What to say about such a link as an input: git-annex and DataLad leave them where they keep no content.
BrokenInput dead_link(const std::string& path);

}  // namespace tagrid
