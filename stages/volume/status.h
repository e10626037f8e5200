// What a decoder says of bytes that it was given. Broken bytes are normal, so this is a value, not an
// exception, and the compiler warns where it is ignored.
#pragma once

#include <string>
#include <utility>

namespace tagrid {

class [[nodiscard]] Status {
 public:
  Status() = default;
  /// `what` names what is wrong with the bytes, for a person: "brick 17: activity ends too soon".
  static Status broken(std::string what) {
    Status status;
    status.ok_ = false;
    status.what_ = std::move(what);
    return status;
  }
  bool ok() const { return ok_; }
  const std::string& what() const { return what_; }

 private:
  bool ok_ = true;
  std::string what_;
};

}  // namespace tagrid
