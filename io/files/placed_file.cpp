#include "io/files/placed_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/system_call.h"

namespace tagrid {

PlacedFile::PlacedFile(const std::string& path, std::string name, bool is_new) : name_(std::move(name)) {
  const int flags = O_WRONLY | O_CLOEXEC | (is_new ? O_CREAT | O_EXCL : 0);
  descriptor_ = uninterrupted([&] { return open(path.c_str(), flags, 0600); });
  if (descriptor_ < 0)
    throw world_error(is_new ? "cannot create" : "cannot open its temporary file", name_, errno);
}

PlacedFile::~PlacedFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

void PlacedFile::resize(std::uint64_t size) {
  if (uninterrupted([&] { return ftruncate(descriptor_, static_cast<off_t>(size)); }) != 0)
    throw world_error("cannot write", name_, errno);
}

void PlacedFile::set_attributes(const FileAttributes& attributes) {
  set_permissions(descriptor_, attributes);
  set_times(descriptor_, attributes);
}

void PlacedFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  if (!write_all_at(descriptor_, position, bytes)) throw world_error("cannot write", name_, errno);
}

void PlacedFile::finish() {
  if (uninterrupted([&] { return fsync(descriptor_); }) != 0) throw world_error("cannot write", name_, errno);
  // Network file systems report some failed writes only in close().
  if (close(std::exchange(descriptor_, -1)) != 0 && errno != EINTR)
    throw world_error("cannot write", name_, errno);
}

}  // namespace tagrid
