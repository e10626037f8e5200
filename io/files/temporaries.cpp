#include "io/files/temporaries.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "io/system/files.h"
#include "io/system/signals.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

constexpr std::string_view temporary_mark = ".part", older_mark = ".old";
constexpr std::string_view suffix_letters = "abcdefghijklmnopqrstuvwxyz012345";
constexpr std::size_t suffix_size = 6;

/// Longer paths are not registered.
constexpr std::size_t most_path = 4096;

constexpr int slot_count = 64;
enum SlotState : int { slot_free, slot_filling, slot_used };
std::array<std::atomic<int>, slot_count> slot_states = {};
char slot_paths[slot_count][most_path], slot_originals[slot_count][most_path];
bool slot_is_folder[slot_count];

std::atomic<int> signal_code{-1};
std::array<char, 200> signal_message;
std::atomic<std::size_t> signal_message_size{0};
std::atomic<bool> signals_wait{false};
std::atomic<int> waiting_signal{0};

int add_to_slots(const std::string& path, const std::string& original, bool folder) {
  if (path.size() >= most_path || original.size() >= most_path) return -1;
  for (int slot = 0; slot < slot_count; ++slot) {
    int expected = slot_free;
    auto& state = slot_states[static_cast<std::size_t>(slot)];
    if (!state.compare_exchange_strong(expected, slot_filling)) continue;
    std::memcpy(slot_paths[slot], path.c_str(), path.size() + 1);
    std::memcpy(slot_originals[slot], original.c_str(), original.size() + 1);
    slot_is_folder[slot] = folder;
    state.store(slot_used);
    return slot;
  }
  return -1;
}

/// The beginning of `name`, which may be as long as names can be.
std::string name_in_temporary_names(const std::string& name) { return name.substr(0, 240); }

std::string hidden_name(const std::string& name, std::string_view mark) {
  return fmt::format(".{}{}{}", name_in_temporary_names(name), mark, random_suffix());
}

std::optional<std::string_view> target_of(std::string_view name, std::string_view mark) {
  const std::size_t end_size = mark.size() + suffix_size;
  if (!name.starts_with('.') || name.size() <= 1 + end_size) return std::nullopt;
  const std::string_view end = name.substr(name.size() - end_size);
  if (!end.starts_with(mark) || end.find_first_not_of(suffix_letters, mark.size()) != end.npos)
    return std::nullopt;
  return name.substr(1, name.size() - end_size - 1);
}

namespace fs = std::filesystem;

/// Removes a directory of files that were to get their names. An older file that was set aside is not
/// removed: it may be the only copy.
bool remove_new_files(const std::string& folder) {
  std::vector<FolderEntry> entries;
  files().list(folder, entries);
  for (const FolderEntry& entry : entries) {
    const std::string path = folder + "/" + entry.name;
    if (!entry.name.ends_with(".old") && !files().unlink(path) && errno == EISDIR) remove_with_files(path);
  }
  return files().remove_folder(folder);
}

/// Removes a file, or with `folders` a directory, if no process holds it.
bool remove_if_abandoned(const std::string& path, bool folders) {
  const Descriptor opened = files().open(path, {.read = true, .follows_link = false, .waits = false});
  FileStatus status;
  if (opened < 0 || !files().is_local(opened) || !files().status(opened, status)) return false;
  // Removed while this process holds it: a process that is about to hold it will see that it is gone.
  const bool is_ours =
      status.type == (folders ? FileType::folder : FileType::regular) && files().lock(opened, false);
  return is_ours && (folders ? remove_new_files(path) : files().unlink(path));
}

/// Removes the lock of an output if no process holds it; see OutputLock. A file with content is not
/// a lock.
void remove_abandoned_lock(const std::string& output) {
  const std::string lock = hidden_beside(output, ".lock");
  if (const auto status = status_of_name(lock); status && status->is_file() && status->size == 0)
    remove_if_abandoned(lock, false);
}

std::size_t remove_abandoned(const std::vector<std::string>& outputs, bool folders) {
  std::map<std::string, std::set<std::string>> names;
  for (const std::string& output : outputs)
    names[folder_of(output)].insert(name_in_temporary_names(name_of_path(output)));
  if (!folders)
    for (const std::string& output : outputs) remove_abandoned_lock(output);
  std::size_t removed = 0;
  for (const auto& [folder, targets] : names) {
    std::vector<FolderEntry> there;
    files().list(folder, there);
    for (const auto& [name, type] : there)
      if (const auto target = target_of_temporary(name); target && targets.contains(std::string(*target)))
        removed += remove_if_abandoned(path_in(folder, name), folders);
  }
  return removed;
}

/// Removes the empty directories around `path`, from the innermost to `outermost`. Async-signal-safe.
void remove_folders_around(const char* path, const char* outermost) noexcept {
  const std::size_t least = std::strlen(outermost);
  std::size_t size = std::strlen(path);
  char folder[most_path];
  if (least == 0 || size >= sizeof folder) return;
  std::memcpy(folder, path, size + 1);
  for (;;) {
    while (size > 0 && folder[size - 1] != '/') --size;
    while (size > 0 && folder[size - 1] == '/') --size;
    if (size < least) return;
    folder[size] = '\0';
    in_handler::remove_folder(folder);
  }
}

}  // namespace

int register_temporary(const std::string& path, const std::string& original) {
  return add_to_slots(path, original, false);
}

int register_temporary_folder(const std::string& path, const std::string& outermost) {
  return add_to_slots(path, outermost, true);
}

void forget_temporary(int slot) {
  if (slot >= 0) slot_states[static_cast<std::size_t>(slot)].store(slot_free);
}

std::string random_suffix() {
  std::array<unsigned char, suffix_size> random = {};
  if (!fill_with_random(random))
    for (auto& byte : random) byte = static_cast<unsigned char>(std::rand());
  std::string suffix;
  for (unsigned char byte : random) suffix += suffix_letters[byte % suffix_letters.size()];
  return suffix;
}

std::string temporary_name(const std::string& name) { return hidden_name(name, temporary_mark); }
std::string older_name(const std::string& name) { return hidden_name(name, older_mark); }
std::string hidden_beside(const std::string& output, std::string_view ending) {
  const fs::path path = path_of(output);
  return text_of(path.parent_path() /
                 path_of(fmt::format(".{}{}", name_in_temporary_names(text_of(path.filename())), ending)));
}

std::optional<std::string_view> target_of_temporary(std::string_view name) {
  return target_of(name, temporary_mark);
}
std::optional<std::string_view> target_of_older(std::string_view name) { return target_of(name, older_mark); }

void unlink_temporaries() noexcept {
  for (int slot = 0; slot < slot_count; ++slot) {
    if (slot_states[static_cast<std::size_t>(slot)].load() != slot_used) continue;
    if (slot_is_folder[slot]) {
      in_handler::remove_with_files(slot_paths[slot]);
      remove_folders_around(slot_paths[slot], slot_originals[slot]);
      continue;
    }
    if (slot_originals[slot][0] != '\0') in_handler::rename(slot_paths[slot], slot_originals[slot]);
    // Also after a rename: rename() keeps both names if they belong to one file.
    in_handler::unlink(slot_paths[slot]);
  }
}

SignalsWait::SignalsWait() { signals_wait = true; }

SignalsWait::~SignalsWait() {
  signals_wait = false;
  const int number = waiting_signal;
  if (number == 0) return;
  unlink_temporaries();
  if (const int code = code_after_signal(); code >= 0) {
    write_message_after_signal();
    in_handler::exit(code);
  }
  in_handler::end_by(number);
}

bool signal_waits(int number) noexcept {
  if (!signals_wait) return false;
  waiting_signal = number;
  return true;
}

void end_signals_with(int code, const std::string& message) {
  const std::size_t size = std::min(message.size(), signal_message.size());
  std::memcpy(signal_message.data(), message.data(), size);
  signal_message_size = size;
  signal_code = code;
}

int code_after_signal() noexcept { return signal_code; }

void write_message_after_signal() noexcept {
  if (signal_message_size > 0) in_handler::say(signal_message.data(), signal_message_size);
}

bool hold_temporary(int descriptor) {
  if (!files().is_local(descriptor)) return true;
  if (!files().lock(descriptor, false) && errno == EWOULDBLOCK) return false;
  FileStatus status;
  return !files().status(descriptor, status) || status.links > 0;
}

/// Also removes the locks of outputs if no process holds them; these are empty, and not counted.
std::size_t remove_abandoned_files(const std::vector<std::string>& outputs) {
  return remove_abandoned(outputs, false);
}
std::size_t remove_abandoned_folders(const std::vector<std::string>& outputs) {
  return remove_abandoned(outputs, true);
}

}  // namespace tagrid
