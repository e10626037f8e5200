#include "io/programs/filled_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/spool_file.h"
#include "io/system/files.h"
#include "io/text/paths.h"

namespace tagrid {

/// A file without a name that another process can open by a path.
class FilledFile::Nameless {
 public:
  explicit Nameless(SpoolFile file) : folder_(file.folder()), descriptor_(file.release()) {}

  const std::string& folder() const { return folder_; }
  std::string path() const { return path_of_open_file(descriptor_); }
  void copy_to(OutputFile& file) const {
    std::vector<std::byte> bytes(std::size_t{1} << 20);
    for (std::uint64_t position = 0;;) {
      const std::ptrdiff_t count = files().read_at(descriptor_, position, bytes);
      if (count < 0) throw world_error("cannot read a temporary file for it", file.name(), errno);
      if (count == 0) return;
      file.write(std::span(bytes).first(static_cast<std::size_t>(count)));
      position += static_cast<std::uint64_t>(count);
    }
  }

 private:
  std::string folder_;
  Descriptor descriptor_;
};

FilledFile::FilledFile(OutputFile& file, const std::string& path, const std::optional<std::string>& spool)
    : file_(file), name_(file.name()) {
  if (!file.can_seek()) {
    nameless_ =
        std::make_unique<Nameless>(spool ? SpoolFile::in(*spool, file.name()) : SpoolFile::beside(path));
    name_ += fmt::format(" (through a temporary file in {})", nameless_->folder());
    path_ = nameless_->path();
    return;
  }
  path_ = text_of(std::filesystem::absolute(path_of(file.temporary())));
  if (const auto status = status_of(file.temporary())) filled_ = *status;
}

FilledFile::~FilledFile() = default;

std::uint64_t FilledFile::complete() {
  if (nameless_) {
    nameless_->copy_to(file_);
    return file_.position();
  }
  const auto status = status_of(file_.temporary());
  if (!status || !status->is_same_file(filled_))
    throw WorldError(file_.name() + ": its writer removed or replaced the file that it was given to fill");
  return status->size;
}

}  // namespace tagrid
