#include "io/files/system_call.h"

#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "io/errors/errors.h"

namespace tagrid {
namespace {

std::optional<struct stat> found(int result, const struct stat& status, const std::string& path) {
  if (result == 0) return status;
  if (errno == ENOENT || errno == ENOTDIR || errno == ELOOP) return std::nullopt;
  throw world_error("cannot get its status", path, errno);
}

}  // namespace

void Descriptor::reset() {
  if (number_ >= 0) close(release());
}

std::optional<struct stat> status_of(const std::string& path) {
  struct stat status = {};
  const int result = stat(path.c_str(), &status);
  return found(result, status, path);
}

std::optional<struct stat> status_of_name(const std::string& path) {
  struct stat status = {};
  const int result = lstat(path.c_str(), &status);
  return found(result, status, path);
}

bool is_dead_link(const std::string& path) {
  const auto name = status_of_name(path);
  return name && S_ISLNK(name->st_mode) && !status_of(path);
}

BrokenInput dead_link(const std::string& path) {
  return BrokenInput(path +
                     ": is a broken symbolic link; its content may have to be fetched first (git annex get)");
}

bool lock_now(int descriptor) {
  return uninterrupted([&] { return flock(descriptor, LOCK_EX | LOCK_NB); }) == 0;
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

bool write_all_at(int descriptor, std::uint64_t position, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const std::size_t most = std::min(bytes.size(), std::size_t{1} << 30);
    const ssize_t count =
        uninterrupted([&] { return pwrite(descriptor, bytes.data(), most, static_cast<off_t>(position)); });
    if (count < 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    position += static_cast<std::uint64_t>(count);
  }
  return true;
}

}  // namespace tagrid
