#include "io/files/held_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>

#include "io/files/temporaries.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

/// "another run", or what the holder wrote about itself. Anybody may have written the file, so only
/// one short line of it is used.
std::string words_of_holder(const std::string& name) {
  const Descriptor file = files().open(name, {.read = true, .follows_link = false, .waits = false});
  std::array<char, 300> text = {};
  const std::ptrdiff_t size = file < 0 ? 0 : files().read(file, std::as_writable_bytes(std::span(text)));
  std::string words(text.data(), size < 0 ? 0 : static_cast<std::size_t>(size));
  words.resize(std::min(words.find('\n'), words.size()));
  return words.starts_with("process ") ? "another run (" + words + ")" : "another run";
}

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// If another user left the file, and this process may not write to it, it can still be locked on a
/// local file system.
Descriptor opened_lock(const std::string& name) {
  Descriptor file = files().open(name, {.read = true, .write = true, .creates = true, .follows_link = false});
  if (file < 0 && errno == EACCES) {
    file = files().open(name, {.read = true, .follows_link = false});
    if (file < 0 && errno == ENOENT) errno = EACCES;  // the directory is not writable
  }
  return file;
}

/// True if the open file is now locked, or cannot be because the file system has no locks. False if another process
/// holds it.
bool is_locked(int file, const std::string& name) {
  if (files().lock(file, false) || errno == ENOSYS || errno == EOPNOTSUPP || errno == ENOLCK ||
      errno == EBADF)
    return true;
  if (errno == EWOULDBLOCK) return false;
  throw world_error("cannot lock", name, errno);
}

/// True if the open file still has this name: the process that held the lock before may have
/// removed it. The name is opened again, because a network file system may report for a while which
/// file had it before. Throws UsageError for a file with content, which is not a lock, and
/// WorldError.
bool has_name(int file, const std::string& name) {
  const Descriptor named = opened_lock(name);
  FileStatus ours, found;
  if (named < 0 || !files().status(file, ours) || !files().status(named, found)) {
    const int error = errno;
    files().unlink(name);  // nothing was created but this
    throw world_error("cannot open the lock", name, error);
  }
  if (ours.size > 0)
    throw UsageError(name + ": has the name that tagrid needs for a lock, but is another file; rename it");
  return ours.is_same_file(found);
}

}  // namespace

HeldFile::HeldFile(int descriptor, const std::string& path) {
  const std::string holder = hidden_beside(path, ".holder");
  if (!files().lock(descriptor, false)) {
    if (errno != EWOULDBLOCK) return;
    throw HeldByAnother(fmt::format("{}: {} is using it; repeat the command when that run has ended", path,
                                    words_of_holder(holder)));
  }
  slot_ = register_temporary(holder);
  const Descriptor file = files().open(
      holder, {.write = true, .creates = true, .empties = true, .follows_link = false, .mode = 0644});
  holder_ = holder;
  // If this fails, the only loss is that others do not learn who holds the file.
  if (file >= 0)
    files().write(file, bytes_of(fmt::format("process {} on {}\n", process_number(), host_name())));
}

HeldFile::~HeldFile() {
  if (!holder_.empty()) files().unlink(holder_);
  forget_temporary(slot_);
}

HeldByName::HeldByName(const std::string& path) {
  constexpr int most_tries =
      100;  // no run renames so often: the numbers of this file system mean something else
  for (int tries = 0; tries < most_tries; ++tries) {
    held.reset();
    // It does not wait if the name is a pipe.
    descriptor = files().open(path, {.read = true, .write = true, .creates = true, .waits = false});
    if (descriptor < 0) throw world_error("cannot open", path, errno);
    held.emplace(descriptor, path);
    FileStatus ours, named;
    if (!files().status(descriptor, ours)) throw world_error("cannot get its status", path, errno);
    if (!ours.is_file()) throw UsageError(path + ": is not a file");
    if (!files().status(path, true, named)) {
      if (errno != ENOENT) throw world_error("cannot get its status", path, errno);
    } else if (named.is_same_file(ours) || !files().is_local(descriptor)) {
      // Network file systems may report other numbers for a while; on these, another run is not seen at once either.
      return;
    }
  }
}

LineFile::LineFile(const std::string& path) : name_(path), held_(path), descriptor_(held_.descriptor) {
  cut_half_line();
  durable_ = size_;
  // Whoever relies on its first line must find the file after a crash of the machine.
  if (size_ > 0) return;
  if (const int error = sync_folder(folder_of(path)); error != 0)
    throw world_error("cannot sync the directory of", path, error);
}

void LineFile::cut(std::uint64_t size) {
  if (!files().resize(descriptor_, size))
    throw world_error("cannot cut off its incomplete last line", name_, errno);
}

void LineFile::cut_half_line() {
  FileStatus status;
  if (!files().status(descriptor_, status)) throw world_error("cannot get its status", name_, errno);
  std::array<char, 4096> bytes;
  for (size_ = status.size; size_ > 0;) {
    const std::uint64_t begin = size_ - std::min<std::uint64_t>(size_, bytes.size());
    const std::ptrdiff_t count =
        files().read_at(descriptor_, begin, std::as_writable_bytes(std::span(bytes).first(size_ - begin)));
    if (count < 0) throw world_error("cannot read", name_, errno);
    const std::size_t end = std::string_view(bytes.data(), static_cast<std::size_t>(count)).rfind('\n');
    size_ = end == std::string_view::npos ? begin : begin + end + 1;
    if (end != std::string_view::npos) break;
  }
  if (size_ < status.size) cut(size_);
}

void LineFile::append(std::string_view line) {
  append_later(line);
  sync();
}

void LineFile::append(std::span<const std::string> lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  write(text);
  sync();
}

void LineFile::append_later(std::string_view line) {
  assert(line.find('\n') == line.npos);
  write(std::string(line) + "\n");
}

void LineFile::write(const std::string& whole) {
  if (!files().write_at(descriptor_, size_, bytes_of(whole))) fail_back_at(size_);
  size_ += whole.size();
}

void LineFile::sync() {
  if (durable_ == size_) return;
  if (!files().sync(descriptor_)) fail_back_at(durable_);
  durable_ = size_;
}

void LineFile::fail_back_at(std::uint64_t size) {
  const int error = errno;
  cut(size);
  size_ = size;
  throw world_error("cannot write", name_, error);
}

std::string lock_of_output(const std::string& path) { return hidden_beside(path, ".lock"); }

OutputLock::OutputLock(const std::string& path) : name_(lock_of_output(path)) {
  for (;;) {
    {
      // A signal that ends the process must not leave the file, nor remove that of another process.
      const SignalsWait wait;
      descriptor_ = opened_lock(name_);
      if (descriptor_ < 0) throw world_error("cannot create the lock", name_, errno);
      if (is_locked(descriptor_, name_) && has_name(descriptor_, name_)) {
        slot_ = register_temporary(name_);
        // Other users wait for it, whatever the umask. This fails if the file is theirs.
        files().set_mode(descriptor_, 0666);
        return;
      }
    }
    // Waits for the process that holds it, and tries again.
    files().lock(descriptor_, true);
  }
}

OutputLock::~OutputLock() {
  files().unlink(name_);
  forget_temporary(slot_);
}

}  // namespace tagrid
