#include "io/system_call.h"

#include "io/errors.h"

namespace tagrid {
namespace {

std::optional<struct stat> found(int result, const struct stat& status, const std::string& path) {
  if (result == 0) return status;
  if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
  throw world_error("cannot look at it", path, errno);
}

}  // namespace

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

}  // namespace tagrid
