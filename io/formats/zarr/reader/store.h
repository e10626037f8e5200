// Where the files of a Zarr hierarchy are: in a folder, or in a zip file (.ozx, RFC-9 of OME-NGFF).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"

namespace tagrid {

/// A file of a store.
struct ZarrFile {
  std::unique_ptr<ByteSource> bytes;
  std::optional<std::uint32_t> crc = std::nullopt;  ///< CRC-32 of all bytes, if the store has it

  /// All bytes. Throws BrokenInput if there are more than `limit`, or if they have another CRC.
  std::vector<std::byte> all(std::uint64_t limit) const;
};

/// Files by their keys, such as "0/c/1/0/2": names with slashes between them, and none at the
/// beginning. All functions throw WorldError, and BrokenInput if the store is damaged or contains a
/// broken symbolic link. Safe for any content and any keys.
class ZarrStore {
 public:
  virtual ~ZarrStore() = default;

  /// The file with this key, if there is one.
  virtual std::optional<ZarrFile> find(const std::string& key) const = 0;
  virtual bool has(const std::string& key) const = 0;
  /// Calls `look` with the name of each file and folder in a folder, in any order. None if there is no such folder.
  virtual void list(const std::string& folder,
                    const std::function<void(const std::string& name, bool is_folder)>& look) const = 0;
  /// A string that is the same for all paths that lead to one folder through links.
  virtual std::string identity(const std::string& folder) const = 0;
  /// The path of a file of the source: the zip file itself, or a file of the folder.
  virtual std::string path_of(const std::string& key) const = 0;
  const std::string& path() const { return path_; }
  /// The names of the folders in a folder that are not hidden, sorted as people do.
  std::vector<std::string> folders(const std::string& folder) const;

 protected:
  explicit ZarrStore(std::string path) : path_(std::move(path)) {}

 private:
  std::string path_;
};

/// Opens the folder or the zip file at `path`. Of a zip file, the table at its end is read: all members must
/// be stored as they are, and have names of their own that lead nowhere else.
std::unique_ptr<ZarrStore> open_zarr_store(const std::string& path);

/// "a/b" for "./a/b", "/a/b/" and the like, as programs write paths in a store.
std::string plain_path(std::string_view path);

/// "a/b" for "a" and "b"; without one of them, the other.
std::string joined(const std::string& folder, const std::string& name);

/// `format`: "Zarr" or "N5".
BrokenInput broken_zarr(const std::string& path, const std::string& why, std::string_view format = "Zarr");

}  // namespace tagrid
