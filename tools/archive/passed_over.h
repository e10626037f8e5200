// Files below a folder that are not volumes and do not belong to one.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tagrid {

class PassedOver {
 public:
  /// `why`: "no known format". A file is one of its folder.
  void add(const std::filesystem::path& file, const std::string& why);
  /// The file belongs to a volume, whether it was added or will be.
  void belongs(const std::string& file);

  /// Calls use(text, files) for each folder and reason: "2019: notes.txt, a.jpg and 3 more: no known format".
  void report(const std::filesystem::path& root,
              const std::function<void(const std::string& text, std::size_t files)>& use) const;

 private:
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> names_;  // by folder and reason
  std::set<std::string> of_volumes_;
};

/// Why a file that no format knows is passed over. Throws WorldError if it cannot be read.
std::string why_no_volume(const std::string& path);

}  // namespace tagrid
