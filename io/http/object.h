// A file on a server, read in ranges.
#pragma once

#include <curl/curl.h>

#include <atomic>
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

}  // namespace tagrid
