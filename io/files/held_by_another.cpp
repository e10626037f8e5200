#include "io/files/held_by_another.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "io/files/temporaries.h"

namespace tagrid {
namespace {

std::string this_process() {
  std::array<char, 256> host = {};
  gethostname(host.data(), host.size() - 1);
  return fmt::format("process {} on {}", getpid(), host.data());
}

/// "another run", or what the holder wrote about itself. Anybody may have written the file, so only
/// one short line of it is used.
std::string words_of_holder(const std::string& name) {
  const Descriptor file =
      uninterrupted([&] { return open(name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC); });
  std::array<char, 300> text = {};
  const ssize_t size = file < 0 ? 0 : uninterrupted([&] { return read(file, text.data(), text.size()); });
  std::string words(text.data(), size < 0 ? 0 : static_cast<std::size_t>(size));
  words.resize(std::min(words.find('\n'), words.size()));
  return words.starts_with("process ") ? "another run (" + words + ")" : "another run";
}

}  // namespace

HeldFile::HeldFile(int descriptor, const std::string& path) {
  const std::string holder = hidden_beside(path, ".holder");
  if (!lock_now(descriptor)) {
    if (errno != EWOULDBLOCK) return;
    throw HeldByAnother(fmt::format("{}: {} is using it; repeat the command when that run has ended", path,
                                    words_of_holder(holder)));
  }
  slot_ = register_temporary(holder);
  const Descriptor file = uninterrupted(
      [&] { return open(holder.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644); });
  holder_ = holder;
  // If this fails, the only loss is that others do not learn who holds the file.
  const std::string text = this_process() + "\n";
  if (file >= 0 && write(file, text.data(), text.size()) < 0) errno = 0;
}

HeldFile::~HeldFile() {
  if (!holder_.empty()) unlink(holder_.c_str());
  forget_temporary(slot_);
}

}  // namespace tagrid
