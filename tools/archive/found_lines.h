// What a search reports: volumes as lines of a list, each with its own output, and files that it passes over.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "tools/archive/find_volumes.h"
#include "tools/archive/name_template.h"

namespace tagrid {

class FoundLines {
 public:
  /// `names`: the template of outputs; null: they have the names of their volumes.
  FoundLines(std::filesystem::path root, const NameTemplate* names,
             const std::function<void(const FoundVolume&)>& use)
      : root_(std::move(root)), names_(names), use_(use) {}

  /// A volume that can be read with these options. `text` describes it, and `type` is that of its samples.
  /// Other formats than DICOM may have the UID of a series, too, which then names no volume.
  void give(const std::filesystem::path& path, const OptionTexts& options, const std::string& text,
            const Subject& subject, const std::string& type, bool is_dicom);
  /// The path looks like a volume and cannot be read. The same error is reported once.
  void give_broken(const std::filesystem::path& path, const OptionTexts& options, const Error& error);
  /// The number of volumes so far.
  std::size_t volumes() const { return volumes_; }
  /// The number of reported errors.
  std::size_t broken() const { return broken_.size(); }

  /// A file that is not a volume. `why`: "no known format". A file is one of its folder.
  void pass_over(const std::filesystem::path& file, const std::string& why);
  /// The file belongs to a volume, whether it was passed over or will be.
  void belongs(const std::string& file);
  /// Reports what belongs to no volume, by folder and reason: "2019: a.txt, b.jpg and 3 more: no known
  /// format".
  void report_passed_over() const;

 private:
  /// Follows from path and options. If an earlier volume has this name, a checksum of both is added.
  std::string output_of(const std::filesystem::path& path, const OptionTexts& options);

  std::filesystem::path root_;
  const NameTemplate* names_;
  const std::function<void(const FoundVolume&)>& use_;
  std::size_t volumes_ = 0;
  std::set<std::string> taken_;               // outputs
  std::map<std::string, std::string> named_;  // by the template, with the paths of their volumes
  std::set<std::string> broken_;              // what is wrong with something, in words
  std::map<std::pair<std::string, std::string>, std::vector<std::string>>
      passed_over_;  // by folder and reason
  std::set<std::string> of_volumes_;
};

/// True for a file that lists the images of a disk.
bool is_directory_of_dicom(const std::filesystem::path& path);

/// Why a file that no format knows is passed over. Throws WorldError if it cannot be read.
std::string why_no_volume(const std::string& path);

}  // namespace tagrid
