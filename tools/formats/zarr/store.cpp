#include "tools/formats/zarr/store.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "io/bytes/memory_size.h"
#include "io/files/system_call.h"
#include "io/text/numbered_names.h"
#include "io/text/text.h"
#include "tools/formats/zarr/zip_file.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

class FolderStore final : public ZarrStore {
 public:
  explicit FolderStore(const std::string& path) : ZarrStore(path) {}

  std::optional<ZarrFile> find(const std::string& key) const override {
    if (!has(key)) return std::nullopt;
    return ZarrFile{std::make_unique<FileSource>(path_of(key))};
  }
  bool has(const std::string& key) const override {
    if (!is_safe_name(key)) return false;
    const auto status = status_of(path_of(key));
    return status && S_ISREG(status->st_mode);
  }
  std::vector<std::string> folders(const std::string& folder, std::size_t most) const override {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator entry(path_of(folder), error), end; !error && entry != end;
         entry.increment(error)) {
      std::error_code unknown;
      const std::string name = entry->path().filename().string();
      if (names.size() < most && !name.starts_with('.') && entry->is_directory(unknown))
        names.push_back(name);
    }
    std::ranges::sort(names, comes_before);
    return names;
  }
  std::string path_of(const std::string& key) const override { return joined(path(), key); }
};

class ZipStore final : public ZarrStore {
 public:
  explicit ZipStore(const std::string& path) : ZarrStore(path), zip_(path) {}

  std::optional<ZarrFile> find(const std::string& key) const override {
    const ZipFile::Member* member = zip_.member(key);
    if (member == nullptr) return std::nullopt;
    return ZarrFile{zip_.open(key, *member), member->crc};
  }
  bool has(const std::string& key) const override { return zip_.member(key) != nullptr; }
  std::vector<std::string> folders(const std::string& folder, std::size_t most) const override {
    std::vector<std::string> names;
    const std::string prefix = folder.empty() ? "" : folder + "/";
    const auto& members = zip_.members();
    for (auto member = members.lower_bound(prefix);
         member != members.end() && member->first.starts_with(prefix) && names.size() < most;) {
      const std::size_t slash = member->first.find('/', prefix.size());
      if (slash == std::string::npos) {
        ++member;
        continue;
      }
      names.push_back(member->first.substr(prefix.size(), slash - prefix.size()));
      member = members.lower_bound(prefix + names.back() + static_cast<char>('/' + 1));
    }
    std::ranges::sort(names, comes_before);
    return names;
  }
  std::string path_of(const std::string&) const override { return path(); }

 private:
  ZipFile zip_;
};

}  // namespace

std::vector<std::byte> ZarrFile::all(std::uint64_t limit) const {
  if (bytes->size() > limit)
    throw BrokenInput(
        fmt::format("{}: has {} bytes, but at most {} are expected", bytes->name(), bytes->size(), limit));
  std::vector<std::byte> content(memory_size(bytes->size()));
  bytes->read_at(0, content);
  if (crc && crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()) != *crc)
    throw BrokenInput(bytes->name() + ": is damaged: its checksum in the zip file is another one");
  return content;
}

std::unique_ptr<ZarrStore> open_zarr_store(const std::string& path) {
  std::error_code unknown;
  if (fs::is_directory(path, unknown)) return std::make_unique<FolderStore>(path);
  return std::make_unique<ZipStore>(path);
}

std::string joined(const std::string& folder, const std::string& name) {
  if (folder.empty() || name.empty()) return folder + name;
  return folder.ends_with('/') ? folder + name : folder + "/" + name;
}

BrokenInput broken_zarr(const std::string& path, const std::string& why) {
  return BrokenInput(fmt::format("{}: Zarr: {}", path, why));
}

}  // namespace tagrid
