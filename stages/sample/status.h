// The result of a decoder. Broken bytes are to be expected, so this is a value, not an exception, and the
// compiler warns if it is ignored.
#pragma once

#include <string>
#include <utility>

namespace tagrid {

class [[nodiscard]] Status {
 public:
  Status() = default;
  /// `what` tells a person what is wrong with the bytes: "brick 17: activity ends too soon".
  static Status broken(std::string what) {
    Status status;
    status.ok_ = false;
    status.what_ = std::move(what);
    return status;
  }
  /// The bytes are whole, but of a newer version of the format.
  static Status newer(const std::string& what) {
    Status status = broken(what + "; the file is of a newer version: update tagrid");
    status.newer_ = true;
    return status;
  }
  bool ok() const { return ok_; }
  bool is_newer() const { return newer_; }
  const std::string& what() const { return what_; }

 private:
  bool ok_ = true, newer_ = false;
  std::string what_;
};

}  // namespace tagrid
