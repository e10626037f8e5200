#include "tests/support/memory_files.h"

#include <algorithm>
#include <cstring>
#include <filesystem>

namespace tagrid {
namespace {

constexpr std::string_view top = "/memory";
constexpr int first_file = 1 << 20;

bool is_in_memory(const std::string& path) {
  return path.starts_with(top) && (path.size() == top.size() || path[top.size()] == '/');
}

std::string normal(const std::string& path) {
  std::string name = std::filesystem::path(path).lexically_normal().string();
  while (name.size() > 1 && name.ends_with('/')) name.pop_back();
  return name;
}

bool failed(int error) {
  errno = error;
  return false;
}

}  // namespace

struct MemoryFiles::Thing : std::enable_shared_from_this<Thing> {
  FileType type = FileType::regular;
  std::uint64_t number = 0, links = 0;
  unsigned mode = 0;
  FileTime accessed, modified, changed;
  std::vector<std::byte> bytes, synced_bytes;
  Names names, synced_names;
  int holder = -1;  ///< the open file that has the lock
};

struct MemoryFiles::Opened {
  std::shared_ptr<Thing> thing;
  std::string path;
  std::uint64_t position = 0;
};

/// Where a name is, or may be.
struct MemoryFiles::Place {
  std::shared_ptr<Thing> folder;  ///< nullptr: there is none
  std::string name;
  std::shared_ptr<Thing> thing;
};

MemoryFiles::MemoryFiles() : next_file_(first_file) { root_ = made(FileType::folder, 0755); }
MemoryFiles::~MemoryFiles() = default;

std::shared_ptr<MemoryFiles::Thing> MemoryFiles::made(FileType type, unsigned mode) {
  auto thing = std::make_shared<Thing>();
  thing->type = type;
  thing->mode = mode & 0755;
  thing->number = next_thing_++;
  thing->accessed = thing->modified = thing->changed = {1'000'000'000 + ++clock_, 0};
  return thing;
}

MemoryFiles::Place MemoryFiles::place_of(const std::string& path) const {
  const std::string name = normal(path);
  if (name == top) return {nullptr, "", root_};
  Place place{root_, "", root_};
  const std::filesystem::path below = std::filesystem::path(name).lexically_relative(top);
  for (const auto& step : below) {
    place.folder = place.thing && place.thing->type == FileType::folder ? place.thing : nullptr;
    place.name = step.string();
    if (!place.folder) return {nullptr, place.name, nullptr};
    const auto found = place.folder->names.find(place.name);
    place.thing = found == place.folder->names.end() ? nullptr : found->second;
  }
  return place;
}

void MemoryFiles::add_folder(const std::string& path) {
  if (path == top || has(path)) return;
  add_folder(std::filesystem::path(path).parent_path().string());
  const Place place = place_of(path);
  place.folder->names[place.name] = place.folder->synced_names[place.name] = made(FileType::folder, 0755);
}

void MemoryFiles::add(const std::string& path, std::string_view bytes) {
  add_folder(std::filesystem::path(path).parent_path().string());
  const Place place = place_of(path);
  const auto thing = made(FileType::regular, 0644);
  thing->links = 1;
  const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
  thing->bytes.assign(first, first + bytes.size());
  thing->synced_bytes = thing->bytes;
  place.folder->names[place.name] = place.folder->synced_names[place.name] = thing;
}

std::string MemoryFiles::content(const std::string& path) const {
  const Place place = place_of(path);
  if (!place.thing) return "";
  return {reinterpret_cast<const char*>(place.thing->bytes.data()), place.thing->bytes.size()};
}

bool MemoryFiles::has(const std::string& path) const { return place_of(path).thing != nullptr; }

void MemoryFiles::visit(const std::function<void(const std::string&, Thing&)>& use) const {
  const std::function<void(const std::string&, Thing&)> enter = [&](const std::string& path, Thing& thing) {
    use(path, thing);
    for (const auto& [name, below] : thing.names) enter(path + "/" + name, *below);
  };
  enter(std::string(top), *root_);
}

std::vector<std::string> MemoryFiles::all() const {
  std::vector<std::string> paths;
  visit([&](const std::string& path, Thing& thing) {
    if (thing.type != FileType::folder) paths.push_back(path);
  });
  return paths;
}

std::size_t MemoryFiles::folders() const {
  std::size_t count = 0;
  visit([&](const std::string&, Thing& thing) { count += thing.type == FileType::folder; });
  return count;
}

void MemoryFiles::spoil(const CallFault& fault) {
  fault_ = fault;
  calls_ = 0;
  counts_ = true;
  spoilt_.clear();
}

void MemoryFiles::end_process() {
  counts_ = false;
  opened_.clear();
  visit([](const std::string&, Thing& thing) { thing.holder = -1; });
}

void MemoryFiles::cut_power(unsigned kept_names) {
  end_process();
  std::vector<std::shared_ptr<Thing>> all_folders;  // also those that lose their names here
  visit([&](const std::string&, Thing& thing) {
    if (thing.type == FileType::folder) all_folders.push_back(thing.shared_from_this());
  });
  for (std::size_t i = 0; i < all_folders.size(); ++i) {
    if ((kept_names >> i & 1u) == 0) all_folders[i]->names = all_folders[i]->synced_names;
    all_folders[i]->synced_names = all_folders[i]->names;
  }
  visit([](const std::string&, Thing& thing) {
    thing.bytes = thing.synced_bytes;
    thing.names = thing.synced_names;  // of a folder that had lost its name
    thing.holder = -1;
  });
}

std::unique_ptr<MemoryFiles> MemoryFiles::copy() const {
  auto other = std::make_unique<MemoryFiles>();
  std::map<const Thing*, std::shared_ptr<Thing>> copies;
  const std::function<std::shared_ptr<Thing>(const Thing&)> copied = [&](const Thing& thing) {
    auto& twin = copies[&thing];
    if (twin) return twin;
    twin = std::make_shared<Thing>(thing);
    const auto made_twin = twin;
    made_twin->holder = -1;
    for (auto& [name, below] : made_twin->names) below = copied(*below);
    for (auto& [name, below] : made_twin->synced_names) below = copied(*below);
    return made_twin;
  };
  other->root_ = copied(*root_);
  other->next_thing_ = next_thing_;
  other->clock_ = clock_;
  return other;
}

bool MemoryFiles::fails(const char* call, const std::string& path) {
  if (!counts_) return false;
  ++calls_;
  if (fault_.at == 0 || (fault_.is_last ? calls_ < fault_.at : calls_ != fault_.at)) return false;
  if (spoilt_.empty()) spoilt_ = std::string(call) + " " + path;
  errno = fault_.error;
  return true;
}

bool MemoryFiles::fails(const char* call, int file) {
  const auto found = opened_.find(file);
  return fails(call, found == opened_.end() ? "a closed file" : found->second.path);
}

MemoryFiles::Opened* MemoryFiles::opened(int file) {
  const auto found = opened_.find(file);
  if (found != opened_.end()) return &found->second;
  errno = EBADF;
  return nullptr;
}

int MemoryFiles::new_number(std::shared_ptr<Thing> thing, const std::string& path) {
  opened_[next_file_] = {std::move(thing), path};
  return next_file_++;
}

int MemoryFiles::open(const std::string& path, const Opening& how) {
  if (!is_in_memory(path)) return files_of_system().open(path, how);
  const std::lock_guard guard(mutex_);
  if (fails(how.write ? "open to write" : "open", path)) return -1;
  Place place = place_of(path);
  if (place.thing && how.is_new) return errno = EEXIST, -1;
  if (place.thing && place.thing->type == FileType::folder && how.write) return errno = EISDIR, -1;
  if (!place.thing) {
    if (!how.creates || !place.folder) return errno = ENOENT, -1;
    place.thing = made(FileType::regular, how.mode);
    place.thing->links = 1;
    place.folder->names[place.name] = place.thing;
  }
  if (how.empties) place.thing->bytes.clear();
  return new_number(place.thing, path);
}

int MemoryFiles::open_folder(const std::string& path) {
  if (!is_in_memory(path)) return files_of_system().open_folder(path);
  const std::lock_guard guard(mutex_);
  if (fails("open folder", path)) return -1;
  const Place place = place_of(path);
  if (!place.thing) return errno = ENOENT, -1;
  if (place.thing->type != FileType::folder) return errno = ENOTDIR, -1;
  return new_number(place.thing, path);
}

int MemoryFiles::open_nameless(const std::string& folder) {
  if (!is_in_memory(folder)) return files_of_system().open_nameless(folder);
  const std::lock_guard guard(mutex_);
  if (fails("open nameless", folder)) return -1;
  return new_number(made(FileType::regular, 0600), folder + "/(nameless)");
}

int MemoryFiles::duplicate(int file) {
  if (file < first_file) return files_of_system().duplicate(file);
  const std::lock_guard guard(mutex_);
  const Opened* one = opened(file);
  return one == nullptr ? -1 : new_number(one->thing, one->path);
}

bool MemoryFiles::close(int file) {
  if (file < first_file) return files_of_system().close(file);
  const std::lock_guard guard(mutex_);
  const bool is_spoilt = fails("close", file);
  const int error = errno;
  Opened* one = opened(file);
  if (one == nullptr) return false;
  if (one->thing->holder == file) one->thing->holder = -1;
  opened_.erase(file);
  return is_spoilt ? failed(error) : true;
}

std::ptrdiff_t MemoryFiles::read(int file, std::span<std::byte> to) {
  if (file < first_file) return files_of_system().read(file, to);
  std::uint64_t from = 0;
  {
    const std::lock_guard guard(mutex_);
    const Opened* one = opened(file);
    if (one == nullptr) return -1;
    from = one->position;
  }
  const std::ptrdiff_t count = read_at(file, from, to);
  const std::lock_guard guard(mutex_);
  if (Opened* one = opened(file); one != nullptr && count > 0)
    one->position = from + static_cast<std::uint64_t>(count);
  return count;
}

std::ptrdiff_t MemoryFiles::read_at(int file, std::uint64_t from, std::span<std::byte> to) {
  if (file < first_file) return files_of_system().read_at(file, from, to);
  const std::lock_guard guard(mutex_);
  if (fails("read", file)) return -1;
  const Opened* one = opened(file);
  if (one == nullptr) return -1;
  const std::vector<std::byte>& bytes = one->thing->bytes;
  if (from >= bytes.size()) return 0;
  const std::size_t count = std::min<std::size_t>(to.size(), bytes.size() - from);
  if (count > 0) std::memcpy(to.data(), bytes.data() + from, count);
  return static_cast<std::ptrdiff_t>(count);
}

void MemoryFiles::write_to(Thing& thing, std::uint64_t at, std::span<const std::byte> bytes) {
  if (thing.bytes.size() < at + bytes.size()) thing.bytes.resize(at + bytes.size());
  if (!bytes.empty()) std::memcpy(thing.bytes.data() + at, bytes.data(), bytes.size());
  thing.modified = thing.changed = {1'000'000'000 + ++clock_, 0};
}

std::ptrdiff_t MemoryFiles::write(int file, std::span<const std::byte> bytes) {
  if (file < first_file) return files_of_system().write(file, bytes);
  const std::lock_guard guard(mutex_);
  Opened* one = opened(file);
  if (one == nullptr) return -1;
  const bool is_spoilt = fails("write", file);
  // Of what does not fit on the disk, the beginning is written.
  if (is_spoilt) bytes = bytes.first(fault_.is_last ? 0 : bytes.size() / 2);
  write_to(*one->thing, one->position, bytes);
  one->position += bytes.size();
  return is_spoilt ? failed(fault_.error), -1 : static_cast<std::ptrdiff_t>(bytes.size());
}

bool MemoryFiles::write_at(int file, std::uint64_t at, std::span<const std::byte> bytes) {
  if (file < first_file) return files_of_system().write_at(file, at, bytes);
  const std::lock_guard guard(mutex_);
  Opened* one = opened(file);
  if (one == nullptr) return false;
  const bool is_spoilt = fails("write", file);
  write_to(*one->thing, at, is_spoilt ? bytes.first(fault_.is_last ? 0 : bytes.size() / 2) : bytes);
  return is_spoilt ? failed(fault_.error) : true;
}

std::int64_t MemoryFiles::position(int file) {
  if (file < first_file) return files_of_system().position(file);
  const std::lock_guard guard(mutex_);
  const Opened* one = opened(file);
  return one == nullptr ? -1 : static_cast<std::int64_t>(one->position);
}

bool MemoryFiles::seek(int file, std::uint64_t position) {
  if (file < first_file) return files_of_system().seek(file, position);
  const std::lock_guard guard(mutex_);
  Opened* one = opened(file);
  if (one == nullptr) return false;
  one->position = position;
  return true;
}

void MemoryFiles::reads_in_order(int) {}

bool MemoryFiles::resize(int file, std::uint64_t size) {
  if (file < first_file) return files_of_system().resize(file, size);
  const std::lock_guard guard(mutex_);
  if (fails("resize", file)) return false;
  Opened* one = opened(file);
  if (one == nullptr) return false;
  one->thing->bytes.resize(size);
  return true;
}

bool MemoryFiles::sync(int file) {
  if (file < first_file) return files_of_system().sync(file);
  const std::lock_guard guard(mutex_);
  if (fails("sync", file)) return false;
  Opened* one = opened(file);
  if (one == nullptr) return false;
  one->thing->synced_bytes = one->thing->bytes;
  one->thing->synced_names = one->thing->names;
  return true;
}

bool MemoryFiles::status(int file, FileStatus& status) {
  if (file < first_file) return files_of_system().status(file, status);
  const std::lock_guard guard(mutex_);
  if (fails("status", file)) return false;
  const Opened* one = opened(file);
  if (one == nullptr) return false;
  const Thing& thing = *one->thing;
  status = {thing.type, thing.bytes.size(), thing.mode,     0,
            0,          thing.accessed,     thing.modified, thing.changed,
            1,          thing.number,       thing.links,    thing.bytes.size()};
  return true;
}

bool MemoryFiles::status(const std::string& path, bool follows_link, FileStatus& status) {
  if (!is_in_memory(path)) return files_of_system().status(path, follows_link, status);
  const std::lock_guard guard(mutex_);
  if (fails("status of path", path)) return false;
  const Place place = place_of(path);
  if (!place.thing) return failed(ENOENT);
  const Thing& thing = *place.thing;
  status = {thing.type, thing.bytes.size(), thing.mode,     0,
            0,          thing.accessed,     thing.modified, thing.changed,
            1,          thing.number,       thing.links,    thing.bytes.size()};
  return true;
}

bool MemoryFiles::is_executable(const std::string& path) {
  return !is_in_memory(path) && files_of_system().is_executable(path);
}

bool MemoryFiles::set_owner(int file, std::uint32_t) {
  const std::lock_guard guard(mutex_);
  return !fails("set owner", file);
}

bool MemoryFiles::set_group(int file, std::uint32_t) {
  const std::lock_guard guard(mutex_);
  return !fails("set group", file);
}

bool MemoryFiles::set_mode(int file, unsigned mode) {
  const std::lock_guard guard(mutex_);
  if (fails("set mode", file)) return false;
  Opened* one = opened(file);
  if (one != nullptr) one->thing->mode = mode;
  return one != nullptr;
}

bool MemoryFiles::set_mode(const std::string& path, unsigned mode) {
  const std::lock_guard guard(mutex_);
  if (fails("set mode", path)) return false;
  const Place place = place_of(path);
  if (!place.thing) return failed(ENOENT);
  place.thing->mode = mode;
  return true;
}

bool MemoryFiles::set_times(int file, FileTime accessed, FileTime modified) {
  const std::lock_guard guard(mutex_);
  if (fails("set times", file)) return false;
  Opened* one = opened(file);
  if (one == nullptr) return false;
  one->thing->accessed = accessed;
  one->thing->modified = modified;
  return true;
}

bool MemoryFiles::lock(int file, bool waits) {
  const std::lock_guard guard(mutex_);
  if (fails("lock", file)) return false;
  Opened* one = opened(file);
  if (one == nullptr) return false;
  if (one->thing->holder >= 0 && one->thing->holder != file) return failed(waits ? EDEADLK : EWOULDBLOCK);
  one->thing->holder = file;
  return true;
}

bool MemoryFiles::is_local(int file) { return file >= first_file || files_of_system().is_local(file); }

bool MemoryFiles::moves(const std::string& from, const std::string& to, bool replaces) {
  const Place source = place_of(from), target = place_of(to);
  if (!source.thing || !target.folder) return failed(ENOENT);
  if (source.thing == target.thing) return replaces ? true : failed(EEXIST);
  if (target.thing && !replaces) return failed(EEXIST);
  if (target.thing && !target.thing->names.empty()) return failed(ENOTEMPTY);
  if (target.thing) --target.thing->links;
  target.folder->names[target.name] = source.thing;
  source.folder->names.erase(source.name);
  source.thing->changed = {1'000'000'000 + ++clock_, 0};
  return true;
}

bool MemoryFiles::rename(const std::string& from, const std::string& to) {
  if (!is_in_memory(from)) return files_of_system().rename(from, to);
  const std::lock_guard guard(mutex_);
  return !fails("rename", to) && moves(from, to, true);
}

bool MemoryFiles::rename_to_new(const std::string& from, const std::string& to) {
  if (!is_in_memory(from)) return files_of_system().rename_to_new(from, to);
  const std::lock_guard guard(mutex_);
  return !fails("rename", to) && moves(from, to, false);
}

bool MemoryFiles::exchange(const std::string& a, const std::string& b) {
  const std::lock_guard guard(mutex_);
  if (fails("exchange", b)) return false;
  const Place one = place_of(a), other = place_of(b);
  if (!one.thing || !other.thing) return failed(ENOENT);
  one.folder->names[one.name] = other.thing;
  other.folder->names[other.name] = one.thing;
  return true;
}

bool MemoryFiles::link(const std::string& from, const std::string& to) {
  const std::lock_guard guard(mutex_);
  if (fails("link", to)) return false;
  const Place source = place_of(from), target = place_of(to);
  if (!source.thing || !target.folder) return failed(ENOENT);
  if (target.thing) return failed(EEXIST);
  target.folder->names[target.name] = source.thing;
  ++source.thing->links;
  source.thing->changed = {1'000'000'000 + ++clock_, 0};
  return true;
}

bool MemoryFiles::unlink(const std::string& path) {
  if (!is_in_memory(path)) return files_of_system().unlink(path);
  const std::lock_guard guard(mutex_);
  if (fails("unlink", path)) return false;
  const Place place = place_of(path);
  if (!place.thing) return failed(ENOENT);
  if (place.thing->type == FileType::folder) return failed(EISDIR);
  --place.thing->links;
  place.folder->names.erase(place.name);
  return true;
}

bool MemoryFiles::make_folder(const std::string& path, unsigned mode) {
  if (!is_in_memory(path)) return files_of_system().make_folder(path, mode);
  const std::lock_guard guard(mutex_);
  if (fails("make folder", path)) return false;
  const Place place = place_of(path);
  if (place.thing) return failed(EEXIST);
  if (!place.folder) return failed(ENOENT);
  place.folder->names[place.name] = made(FileType::folder, mode);
  return true;
}

bool MemoryFiles::remove_folder(const std::string& path) {
  if (!is_in_memory(path)) return files_of_system().remove_folder(path);
  const std::lock_guard guard(mutex_);
  if (fails("remove folder", path)) return false;
  const Place place = place_of(path);
  if (!place.thing) return failed(ENOENT);
  if (place.thing->type != FileType::folder) return failed(ENOTDIR);
  if (!place.thing->names.empty()) return failed(ENOTEMPTY);
  place.folder->names.erase(place.name);
  return true;
}

bool MemoryFiles::list(const std::string& folder, std::vector<FolderEntry>& entries) {
  if (!is_in_memory(folder)) return files_of_system().list(folder, entries);
  const std::lock_guard guard(mutex_);
  entries.clear();
  if (fails("list", folder)) return false;
  const Place place = place_of(folder);
  if (!place.thing) return failed(ENOENT);
  if (place.thing->type != FileType::folder) return failed(ENOTDIR);
  for (const auto& [name, thing] : place.thing->names) entries.push_back({name, thing->type});
  return true;
}

bool MemoryFiles::resolve(const std::string& path, std::string& resolved) {
  if (!is_in_memory(path)) return files_of_system().resolve(path, resolved);
  const std::lock_guard guard(mutex_);
  if (fails("resolve", path)) return false;
  if (!place_of(path).thing) return failed(ENOENT);
  resolved = normal(path);
  return true;
}

bool MemoryFiles::room(const std::string& folder, Room& room) {
  if (!is_in_memory(folder)) return files_of_system().room(folder, room);
  room = {std::uint64_t{1} << 40, false};
  return true;
}

}  // namespace tagrid
