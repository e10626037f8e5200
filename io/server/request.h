// Requests of HTTP/1.1, as browsers send them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tagrid {

/// The head of a request. Texts are as they were sent.
struct WebRequest {
  std::string method, path;                        ///< without what follows a question mark
  std::optional<std::string> host, range, origin;  ///< nothing if absent
  bool has_body = false;                           ///< a body follows, or may follow
  bool is_last = false;                            ///< the connection ends with it
};

/// The request of a head: its lines, up to the empty one. Nothing if it is not one of HTTP/1.0 or 1.1, if it
/// names two hosts, ranges or origins, or no host in HTTP/1.1. Safe for any bytes.
std::optional<WebRequest> request_of(std::string_view head);

/// A part of `size` bytes: [first, end).
struct AskedPart {
  enum class Kind : std::uint8_t { all, part, none };
  Kind kind = Kind::all;
  std::uint64_t first = 0, end = 0;
};

/// What "bytes=0-99", "bytes=100-" or "bytes=-100" asks for. Other texts, and several ranges at once, count as
/// none given, so that they ask for all; a range that begins at or after the end has the kind `none`. One that
/// ends after the end, however far, ends there.
AskedPart part_of(std::string_view range, std::uint64_t size);

}  // namespace tagrid
