#include "io/files/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "io/errors/errors.h"
#include "io/files/system_call.h"
#include "io/text/printable.h"

namespace tagrid {

FileSource::FileSource(const std::string& path) : name_(shown_input(path)) {
  // O_NONBLOCK: opening a pipe must not wait for a writer, as a pipe is refused anyway.
  descriptor_ = path == "-"
                    ? fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0)
                    : uninterrupted([&] { return open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK); });
  if (descriptor_ < 0) throw world_error("cannot open", name_, errno);
  struct stat status = {};
  int error = fstat(descriptor_, &status) != 0 ? errno : 0;
  if (error == 0 && S_ISDIR(status.st_mode)) error = EISDIR;
  const bool is_file = error == 0 && S_ISREG(status.st_mode);
  off_t base = 0;
  if (is_file && (base = lseek(descriptor_, 0, SEEK_CUR)) < 0) error = errno;
  if (!is_file || error != 0) close(descriptor_);
  if (error != 0) throw world_error("cannot read", name_, error);
  if (!is_file)
    throw WorldError(
        name_ +
        ": is not a regular file, and only regular files can be read in any order; copy it to a file first");
  base_ = static_cast<std::uint64_t>(base);
  size_ = static_cast<std::uint64_t>(std::max<off_t>(status.st_size - base, 0));
}

FileSource::~FileSource() { close(descriptor_); }

void FileSource::read_at(std::uint64_t position, std::span<std::byte> to) const {
  position += base_;
  while (!to.empty()) {
    const std::size_t most = std::min(to.size(), std::size_t{1} << 30);
    const ssize_t count =
        uninterrupted([&] { return pread(descriptor_, to.data(), most, static_cast<off_t>(position)); });
    if (count < 0) throw world_error("cannot read", name_, errno);
    if (count == 0) throw WorldError(name_ + ": became shorter while it was being read");
    to = to.subspan(static_cast<std::size_t>(count));
    position += static_cast<std::uint64_t>(count);
  }
}

}  // namespace tagrid
