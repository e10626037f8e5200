#include "io/files/file_attributes.h"

#include <algorithm>
#include <cerrno>

#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

std::optional<FileStatus> status_of_stream_or(const std::string& path, int stream) {
  if (path != "-") return status_of(path);
  FileStatus status;
  return files().status(stream, status) ? std::optional(status) : std::nullopt;
}

}  // namespace

std::optional<FileAttributes> attributes_of(const std::string& path) {
  if (path == "-") return std::nullopt;
  const auto status = status_of(path);
  if (!status || !status->is_file()) return std::nullopt;
  return FileAttributes{status->mode, status->owner, status->group, status->accessed, status->modified};
}

void set_permissions(int descriptor, const FileAttributes& attributes) {
  // Failures are no errors: some file systems have no owners or permissions, and only root changes owners.
  unsigned mode = attributes.mode;
  files().set_owner(descriptor, attributes.owner);
  if (!files().set_group(descriptor, attributes.group))
    mode = (mode & 0707) | (((mode >> 3) & mode & 07) << 3);
  files().set_mode(descriptor, mode);
}

void set_times(int descriptor, const FileAttributes& attributes) {
  files().set_times(descriptor, attributes.accessed, attributes.modified);
}

bool is_regular_input(const std::string& path) {
  if (is_declared_source(path)) return true;
  const auto status = status_of_stream_or(path, standard_input);
  return status && status->is_file();
}

std::optional<std::filesystem::path> without_links(const std::filesystem::path& path) {
  std::string file;
  if (files().resolve(text_of(path), file)) return path_of(file);
  if (errno == ENOENT) return std::nullopt;
  throw world_error("cannot look at", text_of(path), errno);
}

std::filesystem::path real_path(const std::filesystem::path& path) {
  const std::filesystem::path whole = absolute_path(path);
  std::filesystem::path rest;
  for (std::filesystem::path known = whole; known.has_relative_path(); known = known.parent_path()) {
    if (std::string found; files().resolve(text_of(known), found))
      return rest.empty() ? path_of(found) : normal_path(path_of(found) / rest);
    if (errno != ENOENT && errno != ENOTDIR) throw world_error("cannot look at", text_of(known), errno);
    rest = rest.empty() ? known.filename() : known.filename() / rest;
  }
  return normal_path(whole);
}

std::filesystem::path real_path_if_known(const std::filesystem::path& path) {
  try {
    return real_path(path);
  } catch (const WorldError&) {
    return absolute_path(path);
  }
}

bool is_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

bool is_folder(const std::string& path) {
  const auto status = path == "-" ? std::nullopt : status_of(path);
  return status && status->is_folder();
}

bool is_file_or_folder(const std::string& path) {
  const auto status = path == "-" ? std::nullopt : status_of(path);
  return status && (status->is_file() || status->is_folder());
}

std::uint64_t size_of_files(const std::vector<std::string>& files) {
  std::uint64_t bytes = 0;
  for (const std::string& file : files)
    if (const auto status = status_of(file); status && status->is_file()) bytes += status->size;
  return bytes;
}

bool is_regular_output(const std::string& path) {
  if (path == "-") return false;
  const auto status = status_of(path);
  return !status || status->is_file();
}

void refuse_same_file(const std::string& input, const std::string& output) {
  const auto in = status_of_stream_or(input, standard_input),
             out = status_of_stream_or(output, standard_output);
  if (!in || !out) return;
  if (!in->is_file() || !in->is_same_file(*out)) return;
  throw UsageError(shown_output(output) +
                   ": is the input itself, which is never written to; choose another output");
}

UnchangedFiles::UnchangedFiles(const std::vector<std::string>& files) {
  for (const std::string& file : files)
    if (const auto status = file == "-" ? std::nullopt : status_of(file);
        status && (status->is_file() || status->is_folder()))
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
    if (now && now->changed != was.changed) return path;
  }
  return "";
}

bool is_untouched(const std::string& path, const FileStatus& was) {
  const auto now = status_of(path);
  return now && now->is_same_file(was) && now->size == was.size && now->modified == was.modified &&
         now->changed == was.changed;
}

bool UnchangedFiles::are_untouched() const {
  return std::ranges::all_of(files_,
                             [](const Known& known) { return is_untouched(known.path, known.status); });
}

std::vector<std::string> UnchangedFiles::paths() const {
  std::vector<std::string> paths;
  for (const Known& known : files_) paths.push_back(known.path);
  return paths;
}

std::int64_t UnchangedFiles::last_change() const {
  std::int64_t last = 0;
  for (const Known& known : files_) last = std::max(last, known.status.changed.seconds);
  return last;
}

void UnchangedFiles::require() const {
  for (const auto& [path, was] : files_) {
    const auto now = status_of(path);
    if (!now || now->number != was.number || now->size != was.size || now->modified != was.modified)
      throw BrokenInput(path + ": was changed while it was being read");
  }
}

void UnchangedFiles::require_opened() const {
  for (const auto& [path, was] : files_)
    if (was.is_file() && Descriptor(files().open(path, {.read = true, .waits = false})) < 0)
      throw world_error("cannot open", path, errno);
  require();
}

}  // namespace tagrid
