// --name: how outputs are named after what their volumes show, instead of after their inputs.
#pragma once

#include <string>
#include <vector>

#include "tools/archive/key_file.h"
#include "tools/archive/subject.h"

namespace tagrid {

/// What a name may say of a volume.
struct NamedVolume {
  Subject subject;
  std::string type;      ///< of samples
  std::string stem;      ///< the name of its file or directory, without extension
  std::string identity;  ///< other volumes have others
};

/// A text as one step of a path, not empty: what paths cannot have, here or on Windows, is written as %2F.
std::string step_of(std::string_view text);

/// A template: "{study_date}/{hash}".
class NameTemplate {
 public:
  /// `keys`: for {hash}; with these, no field may be used that names a patient. They must outlive the template, or are
  /// null. Throws UsageError, which lists all fields.
  NameTemplate(const std::string& text, const KeyFile* keys);

  /// The output of a volume, without .tag. Long values are cut. Volumes can have the same.
  std::string name_of(const NamedVolume& volume) const;

 private:
  struct Part {
    bool is_field = false;
    std::string text;
  };

  std::vector<Part> parts_;
  const KeyFile* keys_;
};

}  // namespace tagrid
