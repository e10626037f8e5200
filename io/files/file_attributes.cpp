#include "io/files/file_attributes.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "io/files/system_call.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

std::optional<struct stat> status_of_stream_or(const std::string& path, int stream) {
  if (path != "-") return status_of(path);
  struct stat status = {};
  if (fstat(stream, &status) == 0) return status;
  return std::nullopt;
}

}  // namespace

std::optional<FileAttributes> attributes_of(const std::string& path) {
  if (path == "-") return std::nullopt;
  const auto status = status_of(path);
  if (!status || !S_ISREG(status->st_mode)) return std::nullopt;
  return FileAttributes{status->st_mode & 0777, status->st_uid, status->st_gid, status->st_atim,
                        status->st_mtim};
}

void set_permissions(int descriptor, const FileAttributes& attributes) {
  // Failures are no errors: some file systems have no owners or permissions, and only root changes owners.
  mode_t mode = attributes.mode;
  if (fchown(descriptor, attributes.owner, static_cast<gid_t>(-1)) != 0) mode &= 0777;
  if (fchown(descriptor, static_cast<uid_t>(-1), attributes.group) != 0)
    mode = (mode & 0707) | (((mode >> 3) & mode & 07) << 3);
  if (fchmod(descriptor, mode) != 0) return;
}

void set_times(int descriptor, const FileAttributes& attributes) {
  const timespec times[2] = {attributes.accessed, attributes.modified};
  if (futimens(descriptor, times) != 0) errno = 0;
}

bool is_regular_input(const std::string& path) {
  if (is_declared_source(path)) return true;
  const auto status = status_of_stream_or(path, STDIN_FILENO);
  return status && S_ISREG(status->st_mode);
}

std::optional<std::filesystem::path> without_links(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::path file = std::filesystem::canonical(path, error);
  if (!error) return file;
  if (error == std::errc::no_such_file_or_directory) return std::nullopt;
  throw world_error("cannot look at", path.string(), error.value());
}

bool is_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

bool is_folder(const std::string& path) {
  const auto status = path == "-" ? std::nullopt : status_of(path);
  return status && S_ISDIR(status->st_mode);
}

bool is_file_or_folder(const std::string& path) {
  const auto status = path == "-" ? std::nullopt : status_of(path);
  return status && (S_ISREG(status->st_mode) || S_ISDIR(status->st_mode));
}

std::uint64_t size_of_files(const std::vector<std::string>& files) {
  std::uint64_t bytes = 0;
  for (const std::string& file : files)
    if (const auto status = status_of(file); status && S_ISREG(status->st_mode))
      bytes += static_cast<std::uint64_t>(status->st_size);
  return bytes;
}

bool is_regular_output(const std::string& path) {
  if (path == "-") return false;
  const auto status = status_of(path);
  return !status || S_ISREG(status->st_mode);
}

void refuse_same_file(const std::string& input, const std::string& output) {
  const auto in = status_of_stream_or(input, STDIN_FILENO), out = status_of_stream_or(output, STDOUT_FILENO);
  if (!in || !out) return;
  if (!S_ISREG(in->st_mode) || in->st_dev != out->st_dev || in->st_ino != out->st_ino) return;
  throw UsageError(shown_output(output) +
                   ": is the input itself, which is never written to; choose another output");
}

UnchangedFiles::UnchangedFiles(const std::vector<std::string>& files) {
  for (const std::string& file : files)
    if (const auto status = file == "-" ? std::nullopt : status_of(file);
        status && (S_ISREG(status->st_mode) || S_ISDIR(status->st_mode)))
      files_.push_back({file, *status});
}

std::uint64_t UnchangedFiles::memory(const std::vector<std::string>& files) {
  constexpr std::uint64_t allocations = 64;
  std::uint64_t sum = 0;
  // Vectors that grow may have twice the room.
  for (const std::string& file : files)
    sum += 2 * sizeof(Known) + sizeof file + 2 * file.size() + allocations;
  return sum;
}

std::string UnchangedFiles::touched() const {
  for (const auto& [path, was] : files_) {
    const auto now = status_of(path);
    if (now && (now->st_ctim.tv_sec != was.st_ctim.tv_sec || now->st_ctim.tv_nsec != was.st_ctim.tv_nsec))
      return path;
  }
  return "";
}

void UnchangedFiles::require() const {
  for (const auto& [path, was] : files_) {
    const auto now = status_of(path);
    if (!now || now->st_ino != was.st_ino || now->st_size != was.st_size ||
        now->st_mtim.tv_sec != was.st_mtim.tv_sec || now->st_mtim.tv_nsec != was.st_mtim.tv_nsec)
      throw BrokenInput(path + ": was changed while it was being read");
  }
}

}  // namespace tagrid
