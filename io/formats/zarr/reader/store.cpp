#include "io/formats/zarr/reader/store.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "io/bytes/memory_size.h"
#include "io/formats/zarr/reader/zip_file.h"
#include "io/system/files.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"
#include "io/text/text.h"

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
    if (!status) require_no_dead_link(key);
    return status && status->is_file();
  }
  void list(const std::string& folder,
            const std::function<void(const std::string& name, bool is_folder)>& look) const override {
    const std::string where = path_of(folder);
    std::error_code error;
    fs::directory_iterator entry(tagrid::path_of(where), error);
    for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
      std::error_code unknown;
      const bool is_folder = entry->is_directory(unknown);
      // A broken link stands for a file whose content is missing: opening it reports this.
      if (is_folder || entry->is_regular_file(unknown) || is_dead_link(text_of(entry->path())))
        look(text_of(entry->path().filename()), is_folder);
    }
    if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
      throw world_error("cannot be listed", where, error.value());
  }
  std::string identity(const std::string& folder) const override {
    const auto status = status_of(path_of(folder));
    return status ? fmt::format("{} {}", status->device, status->number) : folder;
  }
  std::string path_of(const std::string& key) const override { return joined(path(), key); }

 private:
  /// A chunk that was never written has no name at all. A chunk that is a broken link, or is in a
  /// folder that is one, is therefore an error.
  void require_no_dead_link(const std::string& key) const {
    for (std::size_t end = key.find('/');; end = key.find('/', end + 1)) {
      const std::string part = path_of(key.substr(0, end));
      if (is_dead_link(part)) throw dead_link(part);
      if (end == std::string::npos || !status_of(part)) return;
    }
  }
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
  void list(const std::string& folder,
            const std::function<void(const std::string& name, bool is_folder)>& look) const override {
    const std::string prefix = folder.empty() ? "" : folder + "/";
    const auto& members = zip_.members();
    for (auto member = members.lower_bound(prefix);
         member != members.end() && member->first.starts_with(prefix);) {
      const std::size_t slash = member->first.find('/', prefix.size());
      const bool is_folder = slash != std::string::npos;
      const std::string name = member->first.substr(prefix.size(), is_folder ? slash - prefix.size() : slash);
      look(name, is_folder);
      if (is_folder)
        member = members.lower_bound(prefix + name + static_cast<char>('/' + 1));
      else
        ++member;
    }
  }
  std::string identity(const std::string& folder) const override { return folder; }
  std::string path_of(const std::string&) const override { return path(); }

 private:
  ZipFile zip_;
};

}  // namespace

std::vector<std::byte> ZarrFile::all(std::uint64_t limit) const {
  if (bytes->size() > limit)
    throw BrokenInput("{}: has {} bytes, but at most {} are expected", bytes->name(), bytes->size(), limit);
  std::vector<std::byte> content(memory_size(bytes->size()));
  bytes->read_at(0, content);
  if (crc && crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()) != *crc)
    throw BrokenInput(bytes->name() + ": is damaged: its checksum in the zip file is another one");
  return content;
}

std::unique_ptr<ZarrStore> open_zarr_store(const std::string& path) {
  std::error_code unknown;
  if (fs::is_directory(path_of(path), unknown)) return std::make_unique<FolderStore>(path);
  return std::make_unique<ZipStore>(path);
}

std::vector<std::string> ZarrStore::folders(const std::string& folder) const {
  std::vector<std::string> names;
  list(folder, [&](const std::string& name, bool is_folder) {
    if (is_folder && !name.starts_with('.')) names.push_back(name);
  });
  std::ranges::sort(names, comes_before);
  return names;
}

std::string plain_path(std::string_view path) {
  std::string plain;
  for (const std::string_view part : split(path, '/'))
    if (!part.empty() && part != ".") plain += (plain.empty() ? "" : "/") + std::string(part);
  return plain;
}

std::string joined(const std::string& folder, const std::string& name) {
  if (folder.empty() || name.empty()) return folder + name;
  return folder.ends_with('/') ? folder + name : folder + "/" + name;
}

BrokenInput broken_zarr(const std::string& path, const std::string& why, std::string_view format) {
  return BrokenInput("{}: {}: {}", path, format, why);
}

}  // namespace tagrid
