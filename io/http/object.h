// A file on a server, read in ranges.
#pragma once

#include <curl/curl.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/http/address.h"

namespace tagrid {

/// What tells one version of a file from another.
struct ObjectVersion {
  std::uint64_t size = 0;
  std::string etag, modified;  ///< as the server gave them; "" if it did not
};

/// A file on a server. Every range is one request, which is repeated if the server is busy or the connection
/// breaks, and every answer must be of the version that the first one was of. All failures are WorldErrors that
/// name the address: it does not answer, is not what it was, or sends something else than was asked for.
class Object {
 public:
  explicit Object(const Address& address) : address_(address) {}
  ~Object();
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;

  /// The first bytes of the file, at most `size`. To be called once, before all else.
  std::vector<std::byte> open(std::size_t size);
  const ObjectVersion& version() const { return *version_; }
  /// Fills `to` with bytes from `position` on. Several threads may do so at once. REQUIRES: the file has them.
  void read(std::uint64_t position, std::span<std::byte> to);

 private:
  CURL* connection();
  std::size_t request(std::uint64_t position, std::span<std::byte> to, std::optional<ObjectVersion>& version);

  Address address_;
  std::optional<ObjectVersion> version_;
  std::mutex mutex_;
  std::vector<CURL*> idle_;               ///< connections that no thread uses
  std::atomic<std::size_t> at_once_ = 0;  ///< requests that wait for the server
};

// How long to wait for a server. A limit on silence alone would not be enough, because a server
// that sends a byte now and then is never silent.

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
