// Headers that name the data files of other headers: removing the volume of one would break the other.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tagrid {

/// Why a file is not only of the volume at `input`, a file: it lies beside this header and has not its name, as all.raw
/// beside a.mhd. Returns "" if it is the header itself or has its name, as a.raw and a_001.raw.
std::string not_own_name(const std::string& input, const std::string& file);

/// The headers of directories, by the files that they name. Each directory is read once. A header is a file of a format
/// that has data in other files, such as NRRD, MetaImage, VRT, XDMF, HDF5 and references for Zarr. Other texts that mention
/// a file (lists, logs, BIDS sidecars) do not need it. Headers also count if they lie in the directory above or directly
/// below, as far as their first 4 MiB go.
class OtherHeaders {
 public:
  struct Named {
    std::string file, header;
  };
  /// The first of the files of a volume that a header names which is not one of them; the path of the header is
  /// relative to the directory of the file. Throws WorldError if a header beside it cannot be read.
  std::optional<Named> first_named(const std::vector<std::string>& volume);

 private:
  using Headers = std::map<std::string, std::vector<std::string>>;  ///< by the names of files
  const Headers& in_folder(const std::string& folder);
  /// The names in a directory, by what they are. Throws WorldError.
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
