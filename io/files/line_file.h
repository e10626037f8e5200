// A file that grows by whole lines, and is whole after every one of them.
#pragma once

#include <string>
#include <string_view>

namespace tagrid {

/// Lines are appended and durable at once. One process at a time writes to such a file. Every failure is a
/// WorldError that names it.
class LineFile {
 public:
  /// Opens the file, or creates it. What follows the last '\n', half a line of a run that was killed, is cut
  /// off. Throws UsageError while another process writes to it.
  explicit LineFile(const std::string& path);
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  /// Appends `line` and '\n': all of it, or nothing where that fails. REQUIRES: no '\n' in `line`.
  void append(std::string_view line);
  const std::string& name() const { return name_; }

 private:
  void lock();
  void cut_half_line();
  void cut(long long size);

  std::string name_;
  int descriptor_ = -1;
  long long size_ = 0;
};

}  // namespace tagrid
