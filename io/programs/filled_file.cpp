#include "io/programs/filled_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/spool_file.h"
#include "io/files/system_call.h"

namespace tagrid {

/// A file without a name that another process can open by a path.
class FilledFile::Nameless {
 public:
  explicit Nameless(SpoolFile file) : folder_(file.folder()), descriptor_(file.release()) {}
  ~Nameless() { close(descriptor_); }
  Nameless(const Nameless&) = delete;
  Nameless& operator=(const Nameless&) = delete;

  const std::string& folder() const { return folder_; }
  std::string path() const { return fmt::format("/proc/{}/fd/{}", getpid(), descriptor_); }
  void copy_to(OutputFile& file) const {
    std::vector<std::byte> bytes(std::size_t{1} << 20);
    for (off_t position = 0;;) {
      const ssize_t count =
          uninterrupted([&] { return pread(descriptor_, bytes.data(), bytes.size(), position); });
      if (count < 0) throw world_error("cannot read a temporary file for it", file.name(), errno);
      if (count == 0) return;
      file.write(std::span(bytes).first(static_cast<std::size_t>(count)));
      position += count;
    }
  }

 private:
  std::string folder_;
  int descriptor_;
};

FilledFile::FilledFile(OutputFile& file, const std::string& path, const std::string& spool)
    : file_(file), name_(file.name()) {
  if (!file.can_seek()) {
    nameless_ = std::make_unique<Nameless>(spool.empty() ? SpoolFile::beside(path)
                                                         : SpoolFile::in(spool, file.name()));
    name_ += fmt::format(" (through a temporary file in {})", nameless_->folder());
    path_ = nameless_->path();
    return;
  }
  path_ = std::filesystem::absolute(file.temporary()).string();
  if (const auto status = status_of(file.temporary())) {
    device_ = status->st_dev;
    number_ = status->st_ino;
  }
}

FilledFile::~FilledFile() = default;

std::uint64_t FilledFile::complete() {
  if (nameless_) {
    nameless_->copy_to(file_);
    return file_.position();
  }
  const auto status = status_of(file_.temporary());
  if (!status || status->st_dev != device_ || status->st_ino != number_)
    throw WorldError(file_.name() + ": its writer removed or replaced the file that it was given to fill");
  return static_cast<std::uint64_t>(status->st_size);
}

}  // namespace tagrid
