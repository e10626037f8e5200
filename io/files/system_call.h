// Calls of the operating system, with what it may answer besides yes and no.
#pragma once

#include <sys/stat.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace tagrid {

/// Makes a call, again as often as a signal interrupts it. Not for close(), which closes the file anyway.
template <class Call>
auto uninterrupted(Call call) {
  for (;;) {
    const auto result = call();
    if (result >= 0 || errno != EINTR) return result;
  }
}

/// Writes all of `bytes` from `position` on, however many calls that takes. False where one fails; errno says
/// why.
bool write_all_at(int descriptor, std::uint64_t position, std::span<const std::byte> bytes);

/// Locks a file for this process alone, until its descriptor is closed, and does not wait for others. False
/// where that fails; errno is EWOULDBLOCK where somebody else has it.
bool lock_now(int descriptor);

/// The folder that a path's name is in: "." where the path says none.
std::string folder_of(const std::string& path);

/// What is known of a file; nothing where there is none. Throws WorldError where that cannot be found out:
/// what cannot be looked at must not be taken for a name that is free.
std::optional<struct stat> status_of(const std::string& path);
/// The same of a name, even where that is a symbolic link.
std::optional<struct stat> status_of_name(const std::string& path);

}  // namespace tagrid
