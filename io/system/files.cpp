#include "io/system/files.h"

#include <filesystem>

#include "io/errors/errors.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

std::optional<FileStatus> status_at(const std::string& path, bool follows_link) {
  FileStatus status;
  if (files().status(path, follows_link, status)) return status;
  if (errno == ENOENT || errno == ENOTDIR || errno == ELOOP || errno == ENAMETOOLONG) return std::nullopt;
  throw world_error("cannot get its status", path, errno);
}

FileSystem* files_instead = nullptr;

/// More than any directory of ours has within it.
constexpr int deepest = 16;

bool remove_with_files(const std::string& folder, int depth) {
  std::vector<FolderEntry> entries;
  // Again as long as it helps: others may add files meanwhile, or a call may have failed once.
  for (bool is_shorter = depth <= deepest; is_shorter && files().list(folder, entries) && !entries.empty();) {
    is_shorter = false;
    for (const FolderEntry& entry : entries) {
      const std::string path = folder + "/" + entry.name;
      if (files().unlink(path) || (errno == EISDIR && remove_with_files(path, depth + 1))) is_shorter = true;
    }
  }
  return files().remove_folder(folder);
}

}  // namespace

FileSystem& files() { return files_instead != nullptr ? *files_instead : files_of_system(); }

FilesInstead::FilesInstead(FileSystem& files) : before_(std::exchange(files_instead, &files)) {}
FilesInstead::~FilesInstead() { files_instead = before_; }

void Descriptor::reset() {
  if (number_ >= 0) files().close(release());
}

std::string folder_of(const std::string& path) {
  const std::string folder = text_of(path_of(path).parent_path());
  return folder.empty() ? "." : folder;
}

std::optional<FileStatus> status_of(const std::string& path) { return status_at(path, true); }
std::optional<FileStatus> status_of_name(const std::string& path) { return status_at(path, false); }

bool is_file(const std::string& path) noexcept {
  FileStatus status;
  return files().status(path, true, status) && status.is_file();
}

bool is_file(const std::string& folder, const FolderEntry& entry) noexcept {
  return entry.type == FileType::link ? is_file(folder + "/" + entry.name) : entry.type == FileType::regular;
}

bool is_folder(const std::string& folder, const FolderEntry& entry) noexcept {
  if (entry.type != FileType::link) return entry.type == FileType::folder;
  FileStatus status;
  return files().status(folder + "/" + entry.name, true, status) && status.is_folder();
}

bool is_same_file(const std::string& a, const std::string& b) noexcept {
  FileStatus of_a, of_b;
  return files().status(a, true, of_a) && files().status(b, true, of_b) && of_a.is_same_file(of_b);
}

bool is_dead_link(const std::string& path) {
  const auto name = status_of_name(path);
  return name && name->is_link() && !status_of(path);
}

BrokenInput dead_link(const std::string& path) {
  return BrokenInput(path +
                     ": is a broken symbolic link; its content may have to be fetched first (git annex get)");
}

int sync_folder(const std::string& folder) {
  const Descriptor opened = files().open_folder(folder);
  if (opened < 0) return errno == EACCES || errno == EPERM ? 0 : errno;
  const int error = files().sync(opened) ? 0 : errno;
  return error == EINVAL || error == ENOTSUP ? 0 : error;
}

bool remove_with_files(const std::string& folder) { return remove_with_files(folder, 0); }

}  // namespace tagrid
