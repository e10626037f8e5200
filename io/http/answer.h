// The answer of a server to a request for a range: its headers, and what they must say.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/http/object.h"

namespace tagrid {

/// "bytes 0-99/1000", where 1000 may be unknown (*), and 0-99 too if the range was not in the file.
struct ContentRange {
  std::optional<std::uint64_t> first, last, size;
};
std::optional<ContentRange> content_range_of(std::string_view text);

/// What is wrong with an answer.
struct Wrong {
  std::string what;    ///< "the server answers 404 (not found)"
  bool again = false;  ///< a further request may succeed
  int seconds = 0;     ///< that the server wants us to wait
};

class Answer {
 public:
  /// `to`: where the bytes from `position` on belong; fewer are possible if the file ends before. `version`: what
  /// the file must be; nothing before the first answer.
  Answer(const Address& address, std::uint64_t position, std::span<std::byte> to,
         const std::optional<ObjectVersion>& version)
      : address_(address), position_(position), to_(to), version_(version) {}

  /// A line of the headers. A status line begins the headers of another answer: after a redirection.
  /// Returns false if there are so many that they may have no end.
  bool take_header(std::string_view line);
  /// Bytes of the body. Returns false if there is no use for more of it.
  bool take_body(std::span<const std::byte> bytes);
  /// After all of it. Nothing if the answer is right.
  std::optional<Wrong> wrong();

  /// True if the last headers were those of a redirection.
  bool is_redirected() const { return status_ >= 300 && status_ < 400; }
  std::size_t taken() const { return taken_; }
  /// The version of the file. REQUIRES: the answer is right.
  ObjectVersion version() const { return {*range_->size, etag_, modified_}; }

 private:
  std::optional<Wrong> wrong_headers();
  /// No range is in such a file.
  bool is_empty_file() const { return status_ == 416 && !version_ && range_ && range_->size == 0U; }
  Wrong wrong_status() const;

  const Address& address_;
  std::uint64_t position_;
  std::span<std::byte> to_;
  const std::optional<ObjectVersion>& version_;
  int status_ = 0;
  std::optional<ContentRange> range_;
  std::string etag_, modified_, encoding_, type_, region_, text_;
  int seconds_ = 0;
  std::size_t expected_ = 0, taken_ = 0, header_bytes_ = 0;
  bool are_headers_checked_ = false;
  std::optional<Wrong> wrong_;
};

}  // namespace tagrid
