#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <cerrno>
#include <cstdint>

#include "io/system/sockets.h"

namespace tagrid {

Descriptor open_local_port(int& number) {
  Descriptor port(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (port < 0) return port;
  const int on = 1;
  setsockopt(port, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(number));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(port, reinterpret_cast<const sockaddr*>(&address), size) != 0 || listen(port, 64) != 0 ||
      getsockname(port, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int error = errno;
    port.reset();
    errno = error;
    return port;
  }
  number = ntohs(address.sin_port);
  return port;
}

Descriptor accept_connection(int port) { return accept4(port, nullptr, nullptr, SOCK_CLOEXEC); }

void set_patience(int connection, std::chrono::seconds longest) {
  const timeval patience = {static_cast<time_t>(longest.count()), 0};
  setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
}

std::ptrdiff_t receive_bytes(int connection, std::span<char> to) {
  return uninterrupted([&] { return recv(connection, to.data(), to.size(), 0); });
}

void end_receiving(int connection) { shutdown(connection, SHUT_RD); }
void end_connection(int connection) { shutdown(connection, SHUT_RDWR); }

}  // namespace tagrid
