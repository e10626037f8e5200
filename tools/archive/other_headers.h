// Finds headers that name data files of other volumes: removing these files would break the
// volumes.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tagrid {

/// Why a file may not belong to the header `input` alone: it does not have its name, such as
/// all.raw next to a.mhd. Returns "" if it is the header itself or has its name, such as a.raw or
/// a_001.raw.
std::string not_own_name(const std::string& input, const std::string& file);

/// The headers of directories, by the files that they name. Each directory is read once. A header
/// is a file of a format that has data in other files, such as NRRD, MetaImage, VRT, XDMF, HDF5 and
/// references for Zarr. Other text files that mention a file (lists, logs, BIDS sidecars) do not
/// need it. Of headers in the directory above and in the directories directly below, the first 4
/// MiB are searched.
class OtherHeaders {
 public:
  struct Named {
    std::string file, header;
  };
  /// The first file of a volume that is named by a header outside the volume. The path of the
  /// header is relative to the directory of the file. Throws WorldError if a header next to the
  /// file cannot be read.
  std::optional<Named> first_named(const std::vector<std::string>& volume);

 private:
  using Headers = std::map<std::string, std::vector<std::string>>;  ///< by the names of files
  const Headers& in_folder(const std::string& folder);
  /// The names in a directory, sorted by kind. Throws WorldError.
  struct Listing {
    std::vector<std::string> files, below, headers, links;
  };
  static Listing list(const std::string& folder);
  /// Adds the headers in `place` that name `files` of `folder`, with one of the texts `before`.
  static void add_headers(const std::string& place, const Listing& listing, const std::string& folder,
                          const std::vector<std::string>& files, const std::vector<std::string>& before,
                          std::uint64_t limit, Headers& headers);

  std::map<std::string, Headers> folders_;
  std::map<std::string, Listing> above_;  ///< without files and directories
};

}  // namespace tagrid
