#include <winsock2.h>
// After <winsock2.h>, which must come before <windows.h>.
#include "io/system/on_windows.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <limits>

#include "io/system/processes.h"
#include "io/system/sockets.h"

namespace tagrid {
namespace {

/// Sets errno as after a call of POSIX. Returns -1.
int fail_of_socket() {
  switch (const int error = WSAGetLastError()) {
    case WSAEWOULDBLOCK:
      errno = EAGAIN;
      break;
    case WSAEADDRINUSE:
      errno = EADDRINUSE;
      break;
    case WSAECONNRESET:
    case WSAECONNABORTED:
      errno = ECONNRESET;
      break;
    case WSAESHUTDOWN:
      errno = EPIPE;
      break;
    case WSAEACCES:
      errno = EACCES;
      break;
    case WSAEMFILE:
    case WSAENOBUFS:
      errno = EMFILE;
      break;
    default:
      windows::fail(static_cast<DWORD>(error));
  }
  return -1;
}

/// A port or a connection. Its calls of Windows do not wait; waiting is done here, so that it ends when another thread
/// ends the connection. Windows does not promise that for calls that wait.
class Socket final : public windows::Stream {
 public:
  explicit Socket(SOCKET socket)
      : socket_(socket), ready_(WSACreateEvent()), ended_(CreateEventW(nullptr, FALSE, FALSE, nullptr)) {
    WSAEventSelect(socket_, ready_.get(), FD_ACCEPT | FD_READ | FD_WRITE | FD_CLOSE);
  }
  ~Socket() override { closesocket(socket_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  SOCKET number() const { return socket_; }
  void set_patience(std::chrono::seconds longest) {
    patience_ = static_cast<DWORD>(std::chrono::milliseconds(longest).count());
  }

  std::ptrdiff_t read(std::span<std::byte> to) override {
    for (;;) {
      ResetEvent(ready_.get());
      const int count = recv(socket_, reinterpret_cast<char*>(to.data()), length(to.size()), 0);
      if (count >= 0) return count;
      // What has arrived before the end is still read.
      if (WSAGetLastError() == WSAEWOULDBLOCK && !reads_) return 0;
      if (!may_try_again()) return -1;
    }
  }
  std::ptrdiff_t write(std::span<const std::byte> bytes) override {
    for (;;) {
      ResetEvent(ready_.get());
      const int count = send(socket_, reinterpret_cast<const char*>(bytes.data()), length(bytes.size()), 0);
      if (count >= 0) return count;
      if (!may_try_again()) return -1;
    }
  }
  void end_writing() override { shutdown(socket_, SD_SEND); }
  void end_reading() {
    reads_ = false;
    SetEvent(ended_.get());
  }
  void end() {
    shutdown(socket_, SD_BOTH);
    end_reading();
  }
  HANDLE readiness() const override { return ready_.get(); }

  /// The next connection that waits, or INVALID_SOCKET.
  SOCKET next() {
    // The call sets it again if one more waits.
    ResetEvent(ready_.get());
    return accept(socket_, nullptr, nullptr);
  }

 private:
  static int length(std::size_t size) {
    return static_cast<int>(std::min<std::size_t>(size, std::numeric_limits<int>::max()));
  }
  /// After a call that failed: waits if it would have waited.
  bool may_try_again() {
    if (WSAGetLastError() != WSAEWOULDBLOCK) return fail_of_socket() >= 0;
    const HANDLE events[] = {ready_.get(), ended_.get()};
    if (WaitForMultipleObjects(2, events, FALSE, patience_) != WAIT_TIMEOUT) return true;
    errno = EAGAIN;
    return false;
  }

  SOCKET socket_;
  windows::Handle ready_;
  windows::Handle ended_;  ///< It wakes whoever waits, once.
  std::atomic<bool> reads_ = true;
  DWORD patience_ = INFINITE;
};

Socket* socket_at(int number) { return dynamic_cast<Socket*>(windows::stream_of(number)); }

Descriptor added(SOCKET socket) { return windows::add({.stream = std::make_unique<Socket>(socket)}); }

bool starts_sockets() {
  WSADATA about;
  static const bool is_started = WSAStartup(MAKEWORD(2, 2), &about) == 0;
  if (!is_started) errno = ENOSYS;
  return is_started;
}

}  // namespace

Descriptor open_local_port(int& number) {
  if (!starts_sockets()) return -1;
  const SOCKET port = WSASocketW(AF_INET, SOCK_STREAM, IPPROTO_TCP, nullptr, 0,
                                 WSA_FLAG_OVERLAPPED | WSA_FLAG_NO_HANDLE_INHERIT);
  if (port == INVALID_SOCKET) return fail_of_socket();
  // Otherwise, another program could take the same port.
  const BOOL on = TRUE;
  setsockopt(port, SOL_SOCKET, SO_EXCLUSIVEADDRUSE, reinterpret_cast<const char*>(&on), sizeof on);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<u_short>(number));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  int size = sizeof address;
  if (bind(port, reinterpret_cast<const sockaddr*>(&address), size) != 0 || listen(port, 64) != 0 ||
      getsockname(port, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    fail_of_socket();
    const int error = errno;
    closesocket(port);
    errno = error;
    return -1;
  }
  number = ntohs(address.sin_port);
  return added(port);
}

Descriptor accept_connection(int port) {
  Socket* const waiting = socket_at(port);
  if (waiting == nullptr) return -1;
  const SOCKET connection = waiting->next();
  return connection == INVALID_SOCKET ? Descriptor(fail_of_socket()) : added(connection);
}

void set_patience(int connection, std::chrono::seconds longest) {
  if (Socket* const socket = socket_at(connection); socket != nullptr) socket->set_patience(longest);
}

std::ptrdiff_t receive_bytes(int connection, std::span<char> to) {
  windows::Stream* const stream = windows::stream_of(connection);
  return stream == nullptr ? -1 : stream->read(std::as_writable_bytes(to));
}

void end_receiving(int connection) {
  if (Socket* const socket = socket_at(connection); socket != nullptr) socket->end_reading();
}

void end_connection(int connection) {
  if (Socket* const socket = socket_at(connection); socket != nullptr) socket->end();
}

std::ptrdiff_t send_bytes(int stream, std::span<const std::byte> bytes) {
  windows::Stream* const found = windows::stream_of(stream);
  return found == nullptr ? -1 : found->write(bytes);
}

void end_sending(int stream) {
  if (windows::Stream* const found = windows::stream_of(stream); found != nullptr) found->end_writing();
}

}  // namespace tagrid
