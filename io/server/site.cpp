#include "io/server/site.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "io/errors/errors.h"
#include "io/server/request.h"
#include "io/system/processes.h"
#include "io/system/sockets.h"

namespace tagrid {
namespace {

constexpr std::size_t most_head_bytes = 16 << 10, piece_bytes = 256 << 10;
constexpr std::chrono::seconds patience{60};

bool send_all(int connection, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const auto sent = send_bytes(connection, bytes);
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

bool send_text(int connection, std::string_view text) {
  return send_all(connection, std::as_bytes(std::span(text)));
}

/// The heads of the requests of a connection, one after the other.
class Heads {
 public:
  explicit Heads(int connection) : connection_(connection) {}

  /// The next head, with its empty line. Nothing if the connection has ended; "" if the head is too long.
  std::optional<std::string> next() {
    constexpr std::string_view end = "\r\n\r\n";
    for (;;) {
      if (const auto at = read_.find(end); at != std::string::npos) {
        std::string head = read_.substr(0, at + end.size());
        read_.erase(0, head.size());
        return head;
      }
      if (read_.size() > most_head_bytes) return "";
      std::array<char, 4096> some;
      const auto count = receive_bytes(connection_, some);
      if (count <= 0) return std::nullopt;
      read_.append(some.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  int connection_;
  std::string read_;
};

/// The first lines of an answer. What a page may load is only what this site has.
std::string head_of(std::string_view status, std::uint64_t bytes, std::string_view fields, bool is_last) {
  return fmt::format(
      "HTTP/1.1 {}\r\n"
      "Content-Length: {}\r\n"
      "{}"
      "Cache-Control: no-store\r\n"
      "Content-Security-Policy: default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; "
      "style-src 'self'; connect-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; "
      "form-action 'none'\r\n"
      "Cross-Origin-Resource-Policy: same-origin\r\n"
      "Referrer-Policy: no-referrer\r\n"
      "X-Content-Type-Options: nosniff\r\n"
      "Connection: {}\r\n"
      "\r\n",
      status, bytes, fields, is_last ? "close" : "keep-alive");
}

bool send_refusal(int connection, std::string_view status, std::string_view fields, bool is_last,
                  bool has_text) {
  const std::string text = fmt::format("{}\n", status);
  const std::string head =
      head_of(status, text.size(), fmt::format("Content-Type: text/plain\r\n{}", fields), is_last);
  return send_text(connection, has_text ? head + text : head) && !is_last;
}

/// What lets a page of another site read an answer; "" if it may not.
std::string fields_for_origin(const WebSite& site, const WebRequest& request) {
  if (std::ranges::find(site.origins, request.origin) == site.origins.end()) return "";
  return fmt::format(
      "Access-Control-Allow-Origin: {}\r\nAccess-Control-Expose-Headers: Content-Range, Accept-Ranges\r\n",
      *request.origin);
}

/// The answer to a browser that asks whether a page of another site may send a request. `fields`: those for
/// its origin.
std::string permission(const std::string& fields, bool is_last) {
  return head_of("200 OK", 0,
                 fields +
                     "Access-Control-Allow-Methods: GET, HEAD\r\n"
                     "Access-Control-Allow-Headers: Range\r\n"
                     "Access-Control-Allow-Private-Network: true\r\n",
                 is_last);
}

/// Returns false if the connection must end. `more`: fields of the answer.
bool send_item(int connection, const WebRequest& request, const WebSite::Item& item, const std::string& more,
               bool has_text) {
  const std::uint64_t size = item.bytes->size();
  const AskedPart part = part_of(request.range.value_or(""), size);
  if (part.kind == AskedPart::Kind::none)
    return send_refusal(connection, "416 Range Not Satisfiable",
                        fmt::format("{}Content-Range: bytes */{}\r\n", more, size), request.is_last,
                        has_text);
  std::string fields = fmt::format("{}Content-Type: {}\r\nAccept-Ranges: bytes\r\n", more, item.type);
  const bool is_part = part.kind == AskedPart::Kind::part;
  if (is_part) fields += fmt::format("Content-Range: bytes {}-{}/{}\r\n", part.first, part.end - 1, size);
  const std::string head =
      head_of(is_part ? "206 Partial Content" : "200 OK", part.end - part.first, fields, request.is_last);
  if (!has_text) return send_text(connection, head) && !request.is_last;
  std::vector<std::byte> piece(std::min<std::uint64_t>(part.end - part.first, piece_bytes));
  bool is_begun = false;
  for (std::uint64_t at = part.first; at < part.end || !is_begun;) {
    const std::span some(piece.data(), std::min<std::uint64_t>(part.end - at, piece.size()));
    try {
      item.bytes->read_at(at, some);
    } catch (const std::exception&) {
      // After the head, the end of the connection is all that can tell of a failure.
      if (!is_begun) send_refusal(connection, "500 Internal Server Error", more, true, true);
      return false;
    }
    if (!is_begun && !send_text(connection, head)) return false;
    is_begun = true;
    if (!send_all(connection, some)) return false;
    at += some.size();
  }
  return !request.is_last;
}

}  // namespace

LocalPort open_port(int number) {
  LocalPort port{{}, number};
  port.socket = open_local_port(port.number);
  // Windows has no words for this error of POSIX.
  const char* const why = errno == EADDRINUSE ? "Address already in use" : std::strerror(errno);
  if (port.socket < 0) throw WorldError("127.0.0.1, port {}: {}", number, why);
  return port;
}

void answer_requests(int connection, int port, const WebSite& site, std::atomic<bool>& ticket_used,
                     IdleSince& idle) {
  using Clock = std::chrono::steady_clock;
  set_patience(connection, patience);
  std::vector<std::string> hosts;
  for (const std::string host : {"127.0.0.1", "localhost"}) {
    hosts.push_back(fmt::format("{}:{}", host, port));
    // Clients leave out the port that addresses have otherwise.
    if (port == 80) hosts.push_back(host);
  }
  Heads heads(connection);
  for (bool goes_on = true; goes_on;) {
    idle = Clock::now();
    const auto head = heads.next();
    idle = Clock::time_point::max();
    if (!head) return;
    const auto request = request_of(*head);
    if (!request) {
      send_refusal(connection, "400 Bad Request", "", true, true);
      return;
    }
    const bool has_text = request->method != "HEAD", is_last = request->is_last;
    const std::string for_origin = fields_for_origin(site, *request);
    const auto refuse = [&](std::string_view status, bool ends, std::string_view fields = "") {
      return send_refusal(connection, status, for_origin + std::string(fields), ends, has_text);
    };
    if (request->has_body) {
      goes_on = refuse("413 Content Too Large", true);
    } else if (std::ranges::find(hosts, request->host) == std::end(hosts)) {
      goes_on = refuse("403 Forbidden", true);
    } else if (request->method == "OPTIONS" && !for_origin.empty()) {
      goes_on = send_text(connection, permission(for_origin, is_last)) && !is_last;
    } else if (request->method != "GET" && request->method != "HEAD") {
      goes_on = refuse("405 Method Not Allowed", is_last, "Allow: GET, HEAD\r\n");
    } else if (const auto found = site.items.find(request->path); found != site.items.end()) {
      goes_on = send_item(connection, *request, found->second, for_origin, has_text);
    } else if (const auto made = site.made ? site.made(request->path) : WebSite::Item(); made.bytes) {
      goes_on = send_item(connection, *request, made, for_origin, has_text);
    } else if (!site.ticket.empty() && request->path == site.ticket && has_text &&
               !ticket_used.exchange(true)) {
      goes_on = refuse("302 Found", is_last, fmt::format("Location: {}\r\n", site.entrance));
    } else {
      goes_on = refuse("404 Not Found", is_last);
    }
  }
}

std::string_view media_type(std::string_view name) {
  constexpr std::pair<std::string_view, std::string_view> types[] = {{".html", "text/html; charset=utf-8"},
                                                                     {".css", "text/css"},
                                                                     {".js", "text/javascript"},
                                                                     {".json", "application/json"},
                                                                     {".wasm", "application/wasm"}};
  for (const auto& [end, type] : types)
    if (name.ends_with(end)) return type;
  return "application/octet-stream";
}

}  // namespace tagrid
