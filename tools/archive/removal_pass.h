// Verifies outputs once more, and decides which originals may be removed.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/archive/conversion.h"
#include "tools/archive/input_removal.h"
#include "tools/archive/records.h"

namespace tagrid {

class RemovalPass {
 public:
  /// `lines` are all lines of the manifest. `options`, `known` and `meter` must outlive the pass.
  RemovalPass(const std::vector<ManifestLine>& lines, const ConversionOptions& options, Resources resources,
              const KnownOutputs& known, ListMeter& meter);

  /// Verifies the output of `line` once more. Returns what may then be removed; nothing if there is nothing to do.
  /// Completes `record`. Throws if the original must be kept.
  std::optional<Removal> verified(const ManifestLine& line, nlohmann::ordered_json& record);
  /// The path of the output of a line.
  std::string output_path(const ManifestLine& line) const;

 private:
  /// A line whose volume cannot be opened, so that its other files, beside the named one, are unknown.
  struct UnknownFiles {
    std::string input, folder;
    std::string beginning;  ///< of its file: a header names other files there
    std::string why;
  };
  void count_files(const ManifestLine& line);
  void require_not_needed(const ManifestLine& line, const std::string& file) const;
  std::vector<std::string> removable(const ManifestLine& line, const KnownOutput& known);
  void require_same_options(const ManifestLine& line, const KnownOutput& known) const;
  void require_kept_files(const ManifestLine& line, const VolumeSource& volume) const;
  void verify(const ManifestLine& line, const KnownOutput& known, nlohmann::ordered_json& record) const;

  const ConversionOptions& options_;
  Resources resources_;
  const KnownOutputs& known_;
  ListMeter& meter_;
  std::map<std::string, int> lines_with_;  ///< file, in how many volumes of the manifest
  std::vector<UnknownFiles> unknown_;
  OtherHeaders headers_;  ///< of the directories that were looked at so far
};

}  // namespace tagrid
