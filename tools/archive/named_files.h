// Which files headers name, as far as this can be found without the readers of their formats; and which
// headers name data files of other volumes: removing these files would break the volumes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tagrid {

/// Headers of data in other files, by the ends of their names.
struct HeaderKind {
  std::string_view ending;
  std::array<std::string_view, 4> words = {};  ///< needs one of these to name files
  const char* pair = "";  ///< ends of the names of data files that it has without naming them; - for none
};
/// The kind of header that a file with this name is; nullptr if it is not a header.
const HeaderKind* kind_of_header(const std::string& name);

/// Names that headers may use, and the files that they mean. Case is ignored, because a header that
/// was written on Windows may use another case.
class MeantFiles {
 public:
  void add(const std::string& name, const std::string& file);
  /// Adds the files that this text means, if it is a path.
  void find(std::string_view text, std::set<std::string>& files) const;
  /// Adds the numbered files of patterns, as "slice%.raw" for slice001.raw, in lower case.
  void find_numbered(const std::set<std::string>& patterns, std::set<std::string>& files) const;

 private:
  std::multimap<std::string, std::pair<std::string, std::string>> names_;  ///< by names in lower case
};

/// The files that a header names. Reads the header up to about byte `limit`. Throws WorldError if
/// it cannot be read, because it may name any file.
std::set<std::string> files_named_by(const std::string& path, const HeaderKind& kind, const MeantFiles& meant,
                                     std::uint64_t limit);

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
