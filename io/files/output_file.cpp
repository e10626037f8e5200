#include "io/files/output_file.h"

#include <array>
#include <cassert>
#include <cerrno>
#include <filesystem>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/temporaries.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// True for files that are not regular, such as /dev/null or a named pipe: they are written directly.
bool is_special(const std::string& path) {
  const auto status = status_of(path);
  return status && !status->is_file() && !status->is_folder();
}

UsageError exists_already(const std::string& path) {
  return UsageError(path + ": already exists", Problem::output_exists);
}

}  // namespace

void check_output(const std::string& path, bool overwrite) {
  if (path == "-") return;
  const std::string name = name_of_path(path);
  if (!is_name_here(name) && lower_case(name) != "nul")
    throw UsageError("{}: no file of Windows can have this name; choose another", printable(path));
  const auto status = status_of_name(path);
  if (!status || is_special(path)) return;
  if (status->is_folder()) throw UsageError(path + ": is a directory; give the name of a file");
  if (!overwrite) throw exists_already(path);
}

OutputFile::OutputFile(const std::string& path, bool overwrite, OutputFileOptions options)
    : path_(path), name_(shown_output(path)), overwrite_(overwrite), options_(std::move(options)) {
  check_output(path, overwrite);
  if (path == "-") {
    descriptor_ = standard_output;
  } else if (is_special(path)) {
    descriptor_ = files().open(path, {.write = true});
    if (descriptor_ < 0) throw world_error("cannot open", name_, errno);
  } else {
    create_temporary();
  }
}

OutputFile::~OutputFile() {
  if (published_) take_back();
  if (!temporary_.empty()) files().unlink(temporary_);
  forget_temporary(slot_);
  if (descriptor_ >= 0 && descriptor_ != standard_output) files().close(descriptor_);
}

std::string OutputFile::hidden_path(const std::string& name) const {
  const std::filesystem::path folder =
      options_.temporaries.empty() ? path_of(path_).parent_path() : path_of(options_.temporaries);
  return text_of(folder / path_of(name));
}

void OutputFile::create_temporary() {
  const std::string target = name_of_path(path_);
  if (target.empty()) throw UsageError(path_ + ": is not the name of a file");
  for (int attempt = 0; attempt < 100; ++attempt) {
    const std::string candidate = hidden_path(temporary_name(target));
    // Registered before it is created, so that a signal in between does not leave it. Its mode is that of any
    // new file, or private until it gets that of another file.
    slot_ = register_temporary(candidate);
    const unsigned mode = options_.like ? 0600 : 0666;
    descriptor_ =
        files().open(candidate, {.read = true, .write = true, .creates = true, .is_new = true, .mode = mode});
    const int error = errno;
    if (descriptor_ >= 0 && hold_temporary(descriptor_)) {
      temporary_ = candidate;
      if (options_.like && !options_.others_write) set_permissions(descriptor_, *options_.like);
      return;
    }
    forget_temporary(std::exchange(slot_, -1));
    if (descriptor_ >= 0)
      files().close(std::exchange(descriptor_, -1));
    else if (error != EEXIST)
      throw world_error("cannot create", name_, error);
  }
  throw world_error("cannot create", name_, EEXIST);
}

void OutputFile::write(std::span<const std::byte> bytes) {
  assert(descriptor_ >= 0);
  while (!bytes.empty()) {
    const std::ptrdiff_t count = files().write(descriptor_, bytes);
    if (count < 0 && errno == EAGAIN) {
      std::array<Awaited, 1> room = {{{descriptor_, true}}};
      wait_for(room, -1);
      continue;
    }
    if (count < 0 && errno == EPIPE) throw ClosedPipe(name_ + ": the reader closed the pipe");
    if (count < 0) throw world_error("cannot write", name_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    position_ += static_cast<std::uint64_t>(count);
  }
}

void OutputFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  assert(can_seek());
  if (!files().write_at(descriptor_, position, bytes)) throw world_error("cannot write", name_, errno);
}

void OutputFile::sync() {
  if (options_.like && !temporary_.empty() && !synced_) {
    if (options_.others_write) set_permissions(descriptor_, *options_.like);
    set_times(descriptor_, *options_.like);
  }
  if (!temporary_.empty() && !synced_ && !files().sync(descriptor_))
    throw world_error("cannot write", name_, errno);
  synced_ = true;
}

void OutputFile::close_descriptor() {
  int descriptor = std::exchange(descriptor_, -1);
  // Network file systems report some failed writes only in close(). Standard output must stay open; closing
  // any of its descriptors reports them.
  if (descriptor == standard_output) descriptor = files().duplicate(standard_output);
  if (descriptor >= 0 && !files().close(descriptor)) throw world_error("cannot write", name_, errno);
}

/// Keeps the file that has the name under another one, until nothing can fail any more. Some file systems
/// cannot do that; there the older file is gone once the new one has its name.
void OutputFile::set_older_aside() {
  const std::string candidate = hidden_path(older_name(name_of_path(path_)));
  older_slot_ = register_temporary(candidate, path_);
  if (files().link(path_, candidate)) {
    older_ = candidate;
    return;
  }
  const int error = errno;
  forget_temporary(std::exchange(older_slot_, -1));
  // Windows: another program holds it. Later, it might be replaced without having been set aside.
  if (error == EBUSY) throw world_error("cannot rename the finished file to", name_, error);
}

void OutputFile::give_name() {
  const bool is_named =
      overwrite_ ? files().rename(temporary_, path_) : files().rename_to_new(temporary_, path_);
  const int error = is_named ? 0 : errno;
  published_ = true;  // also on failure: the older file has two names
  if (error == EEXIST) throw exists_already(path_);
  if (error != 0) throw world_error("cannot rename the finished file to", name_, error);
  temporary_.clear();
  forget_temporary(slot_);
  slot_ = older_.empty() ? register_temporary(path_) : -1;
}

void OutputFile::take_back() noexcept {
  published_ = false;
  if (!older_.empty()) {
    // rename() does nothing if both names belong to one file: then the second name has to go.
    if (files().rename(older_, path_)) files().unlink(older_);
    forget_temporary(std::exchange(older_slot_, -1));
  } else if (temporary_.empty()) {
    files().unlink(path_);
  }
  older_.clear();
}

void OutputFile::publish() {
  assert(descriptor_ >= 0);
  sync();
  close_descriptor();
  if (temporary_.empty()) return;
  if (overwrite_) set_older_aside();
  try {
    give_name();
    if (const int error = sync_folder(folder_of(path_)); error != 0)
      throw world_error("cannot sync its directory", name_, error);
  } catch (...) {
    take_back();
    throw;
  }
}

void OutputFile::keep() {
  published_ = false;
  forget_temporary(std::exchange(slot_, -1));
  if (older_.empty()) return;
  const std::string older = std::exchange(older_, "");
  const int error = files().unlink(older) ? 0 : errno;
  forget_temporary(std::exchange(older_slot_, -1));
  if (error != 0) throw world_error("cannot remove the older file of this name", older, error);
}

PlacedFile::PlacedFile(const std::string& path, std::string name, bool is_new) : name_(std::move(name)) {
  descriptor_ = files().open(path, {.write = true, .creates = is_new, .is_new = is_new, .mode = 0600});
  if (descriptor_ < 0)
    throw world_error(is_new ? "cannot create" : "cannot open its temporary file", name_, errno);
}

void PlacedFile::resize(std::uint64_t size) {
  if (!files().resize(descriptor_, size)) throw world_error("cannot write", name_, errno);
}

void PlacedFile::set_attributes(const FileAttributes& attributes) {
  set_permissions(descriptor_, attributes);
  set_times(descriptor_, attributes);
}

void PlacedFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  if (!files().write_at(descriptor_, position, bytes)) throw world_error("cannot write", name_, errno);
}

void PlacedFile::finish() {
  if (!files().sync(descriptor_)) throw world_error("cannot write", name_, errno);
  // Network file systems report some failed writes only in close().
  if (!files().close(descriptor_.release())) throw world_error("cannot write", name_, errno);
}

}  // namespace tagrid
