// How long to wait for a server. A limit on silence alone would not be enough, because a server
// that sends a byte now and then is never silent.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tagrid {

/// What a server must do: begin to send the file within `seconds`, and then send `bytes` in every
/// interval of `seconds`.
struct Patience {
  std::chrono::seconds seconds{30};
  std::uint64_t bytes = 0;
};

/// TAGRID_HTTP_TIMEOUT seconds, 30 by default, and 4096 bytes for each of them, but for at most 30
/// of them. A longer time therefore allows a slower server. Throws UsageError.
Patience patience_with_servers();

/// One request. Time spent on redirections and headers is included, so that neither can go on
/// forever.
class Waiting {
 public:
  using Clock = std::chrono::steady_clock;
  Waiting(const Patience& patience, Clock::time_point now) : patience_(patience), begin_(now) {}

  /// `bytes` of the file have arrived. `at_once`: the number of requests that share the connection
  /// to this server; each must receive its share of the bytes of one. Returns true if the request
  /// should fail.
  bool is_over(std::size_t bytes, std::size_t at_once, Clock::time_point now);

 private:
  Patience patience_;
  Clock::time_point begin_;  ///< of the request, or of the current interval
  std::size_t before_ = 0;   ///< bytes that had arrived then
  bool has_begun_ = false;   ///< to send the file
  std::size_t most_at_once_ = 1;
};

}  // namespace tagrid
