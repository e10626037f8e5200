// Verifies outputs once more, and removes their originals.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/archive/conversion.h"
#include "tools/archive/input_removal.h"
#include "tools/archive/records.h"
#include "tools/archive/removal_table.h"

namespace tagrid {

class RemovalPass {
 public:
  /// `lines` are all lines of the manifest. `options`, `known` and `meter` must outlive the pass.
  RemovalPass(const std::vector<ManifestLine>& lines, const ConversionOptions& options, Resources resources,
              KnownOutputs& known, ListMeter& meter);

  /// Verifies the output of `line` once more, and removes the original. Completes `record`, and calls
  /// `append` before the removal, or if nothing is to be done. Throws if files of the original are kept.
  void remove_original(const ManifestLine& line, nlohmann::ordered_json& record,
                       const std::function<void()>& append);

 private:
  /// A line whose volume cannot be opened, so that its other files, beside the named one, are unknown.
  struct UnknownFiles {
    std::string input, folder;
    std::string beginning;  ///< of its file: a header names other files there
    std::string why;
  };
  /// The volume of a line and its output.
  struct Volume {
    const ManifestLine& line;
    std::string output;
    std::optional<KnownOutput> known;
    std::optional<Removal> removal = {};  ///< since its files are known
    std::string difference = {};          ///< of the options
  };
  void count_files(const ManifestLine& line);
  void require_not_needed(const ManifestLine& line, const std::string& file) const;
  archive::Input look(Volume& volume, nlohmann::ordered_json& record);
  void compare_options(Volume& volume, archive::Facts& facts) const;
  void verify(const Volume& volume, archive::Facts& facts);
  void require_kept_files(const Volume& volume, const VolumeSource& source) const;
  void require_removable_still(const Volume& volume, archive::Facts facts, nlohmann::ordered_json& record);
  void make_durable(const std::string& output);
  [[noreturn]] void keep(archive::Action reason, const Volume& volume, nlohmann::ordered_json& record) const;

  const ConversionOptions& options_;
  Resources resources_;
  KnownOutputs& known_;
  ListMeter& meter_;
  std::map<std::string, int> lines_with_;  ///< file, in how many volumes of the manifest
  std::vector<UnknownFiles> unknown_;
  std::set<std::string> durable_folders_;  ///< of outputs
  OtherHeaders headers_;                   ///< of the directories that were looked at so far
};

}  // namespace tagrid
