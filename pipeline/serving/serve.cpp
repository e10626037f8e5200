#include "pipeline/serving/serve.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <functional>
#include <list>
#include <span>
#include <system_error>
#include <thread>

#include "io/errors/errors.h"
#include "io/system/sockets.h"

namespace tagrid {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t most_connections = 64;
// A connection that has waited for so long for a request makes room for a new one. Browsers open another one.
constexpr std::chrono::seconds most_idle{1};

struct Connection {
  Descriptor socket;
  IdleSince idle = Clock::time_point::max();
  std::atomic<bool> has_ended = false;
  std::jthread thread;
};

/// Ends the connection that has waited longest for a request. One that has just arrived is still answered.
void make_room(const std::list<Connection>& connections) {
  const auto longest =
      std::ranges::min_element(connections, {}, [](const Connection& c) { return c.idle.load(); });
  if (longest->idle.load() < Clock::now() - most_idle) end_receiving(longest->socket);
}

}  // namespace

void serve(const LocalPort& port, const WebSite& site, int end, const std::function<void()>& ended) {
  std::atomic<bool> ticket_used = false;
  std::list<Connection> connections;
  for (;;) {
    connections.remove_if([](const Connection& connection) { return connection.has_ended.load(); });
    const bool is_full = connections.size() >= most_connections;
    std::array<Awaited, 2> waits = {{{end}, {port.socket}}};
    const std::span is_over = std::span(waits).first(1), arrives = std::span(waits).last(1);
    // If no more fit in, it looks a little later whether one has ended.
    int ready = 0;
    while ((ready = wait_for(is_full ? is_over : waits, is_full ? 50 : -1)) < 0 && errno == EINTR) {
    }
    if (ready < 0) throw WorldError("127.0.0.1, port {}: {}", port.number, std::strerror(errno));
    if (waits[0].is_ready) break;
    if (is_full && wait_for(arrives, 0) > 0) make_room(connections);
    if (is_full || !waits[1].is_ready) continue;
    Descriptor socket = accept_connection(port.socket);
    // It may have ended in the meantime, or the process has no more descriptors.
    if (socket < 0) {
      wait_for(is_over, 50);
      continue;
    }
    Connection& connection = connections.emplace_back();
    connection.socket = std::move(socket);
    try {
      connection.thread = std::jthread([&connection, &port, &site, &ticket_used] {
        try {
          answer_requests(connection.socket, port.number, site, ticket_used, connection.idle);
        } catch (...) {
          // Memory ran out, for one connection.
        }
        end_connection(connection.socket);
        connection.has_ended = true;
      });
    } catch (const std::system_error&) {
      // There is no thread for it.
      connections.pop_back();
    }
  }
  for (const Connection& connection : connections) end_connection(connection.socket);
  ended();
}

}  // namespace tagrid
