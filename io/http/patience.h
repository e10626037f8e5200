// How long a server is waited for. A limit on silence alone would not end: a server that sends a byte now and then is
// never silent.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tagrid {

/// What a server must do: begin to send the file within `seconds`, and then send `bytes` in each such time.
struct Patience {
  std::chrono::seconds seconds{30};
  std::uint64_t bytes = 0;
};

/// TAGRID_HTTP_TIMEOUT seconds, 30 by default, and 4096 bytes for each of them, at most for 30: more seconds allow a
/// slower server. Throws UsageError.
Patience patience_with_servers();

/// One request. The time of redirections and headers counts, so none of them can be without end.
class Waiting {
 public:
  using Clock = std::chrono::steady_clock;
  Waiting(const Patience& patience, Clock::time_point now) : patience_(patience), begin_(now) {}

  /// `bytes` of the file have arrived. `at_once`: requests that share the connection to this server, each of which
  /// must send its part of what one must. True if the server is given up.
  bool is_over(std::size_t bytes, std::size_t at_once, Clock::time_point now);

 private:
  Patience patience_;
  Clock::time_point begin_;  ///< of the request, or of the present time of `seconds`
  std::size_t before_ = 0;   ///< bytes that had arrived then
  bool has_begun_ = false;   ///< to send the file
  std::size_t most_at_once_ = 1;
};

}  // namespace tagrid
