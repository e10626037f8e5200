#include "io/files/line_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>

#include "io/errors/errors.h"

namespace tagrid {

LineFile::LineFile(const std::string& path) : name_(path) {
  // O_NONBLOCK: does not wait if the name is a pipe.
  constexpr int flags = O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK;
  descriptor_ = uninterrupted([&] { return open(path.c_str(), flags, 0666); });
  if (descriptor_ < 0) throw world_error("cannot open", name_, errno);
  held_.emplace(descriptor_, path);
  cut_half_line();
}

void LineFile::cut(long long size) {
  if (uninterrupted([&] { return ftruncate(descriptor_, size); }) != 0)
    throw world_error("cannot cut off its incomplete last line", name_, errno);
}

void LineFile::cut_half_line() {
  struct stat status = {};
  if (fstat(descriptor_, &status) != 0) throw world_error("cannot get its status", name_, errno);
  if (!S_ISREG(status.st_mode)) throw UsageError(name_ + ": is not a file");
  std::array<char, 4096> bytes;
  for (size_ = status.st_size; size_ > 0;) {
    const long long begin = std::max(size_ - static_cast<long long>(bytes.size()), 0LL);
    const auto wanted = static_cast<std::size_t>(size_ - begin);
    const ssize_t count = uninterrupted([&] { return pread(descriptor_, bytes.data(), wanted, begin); });
    if (count < 0) throw world_error("cannot read", name_, errno);
    const std::size_t end = std::string_view(bytes.data(), static_cast<std::size_t>(count)).rfind('\n');
    size_ = end == std::string_view::npos ? begin : begin + static_cast<long long>(end) + 1;
    if (end != std::string_view::npos) break;
  }
  if (size_ < status.st_size) cut(size_);
}

void LineFile::append(std::string_view line) {
  assert(line.find('\n') == line.npos);
  const std::string whole = std::string(line) + "\n";
  std::size_t done = 0;
  while (done < whole.size()) {
    const ssize_t count = uninterrupted([&] {
      return pwrite(descriptor_, whole.data() + done, whole.size() - done,
                    size_ + static_cast<long long>(done));
    });
    const int error = errno;
    if (count < 0) {
      cut(size_);
      throw world_error("cannot write", name_, error);
    }
    done += static_cast<std::size_t>(count);
  }
  if (uninterrupted([&] { return fsync(descriptor_); }) != 0) {
    const int error = errno;
    cut(size_);
    throw world_error("cannot write", name_, error);
  }
  size_ += static_cast<long long>(done);
}

}  // namespace tagrid
