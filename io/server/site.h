// What a web server of this machine gives to browsers of this machine.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/byte_source.h"
#include "io/system/files.h"

namespace tagrid {

/// Bytes for whoever knows their path. Nothing else is given out: paths are compared, never made into names
/// of files, and pages of other sites read only what they are allowed to.
struct WebSite {
  struct Item {
    std::shared_ptr<const ByteSource> bytes;
    std::string type;  ///< "text/html"
  };
  /// By their paths, which begin with "/" and are as browsers send them: with %20 for a blank.
  std::map<std::string, Item> items;
  /// Returns the item of a path that is not in `items`; an item without bytes if the path leads to nothing.
  /// Several threads may call it at once; each reads the item that it got. May be empty.
  std::function<Item(std::string_view path)> made;
  /// Pages of other sites that may read this one: "https://example.org".
  std::vector<std::string> origins;
  /// A path that leads to `entrance` once; "": none. Command lines may show it, which other users can read.
  std::string ticket, entrance;
};

/// A port of 127.0.0.1, on which connections wait to be accepted.
struct LocalPort {
  Descriptor socket;
  int number = 0;
};
/// 0: the system chooses the port. Throws WorldError if the port is taken.
LocalPort open_port(int number);

/// Since when a connection waits for a request; time_point::max() while it is answered.
using IdleSince = std::atomic<std::chrono::steady_clock::time_point>;

/// Answers the requests of a connection with bytes of the site, until it ends, fails, or says nothing for a
/// minute. GET and HEAD, with at most one range. Requests must name the machine 127.0.0.1 or localhost with
/// this port, as those of a page of another site do not, even if its name leads to this machine.
/// `ticket_used`: of all connections.
void answer_requests(int connection, int port, const WebSite& site, std::atomic<bool>& ticket_used,
                     IdleSince& idle);

/// The type of a file, by its name.
std::string_view media_type(std::string_view name);

}  // namespace tagrid
