// A file that grows by complete lines and is complete after every line.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "io/files/held_by_another.h"
#include "io/files/system_call.h"

namespace tagrid {

/// Appended lines are durable at once. One process at a time holds the file; see HeldFile. Failures are WorldErrors.
class LineFile {
 public:
  /// Opens the file, or creates it. Anything after the last '\n', half a line of a killed run, is cut off.
  /// Throws HeldByAnother if another process holds it.
  explicit LineFile(const std::string& path);

  /// Appends `line` and '\n': all of it, or nothing on failure. REQUIRES: no '\n' in `line`.
  void append(std::string_view line);
  const std::string& name() const { return name_; }

 private:
  void cut_half_line();
  void cut(long long size);

  std::string name_;
  Descriptor descriptor_;
  std::optional<HeldFile> held_;
  long long size_ = 0;
};

}  // namespace tagrid
