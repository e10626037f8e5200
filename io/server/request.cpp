#include "io/server/request.h"

#include <algorithm>
#include <charconv>
#include <limits>

#include "io/text/text.h"

namespace tagrid {
namespace {

/// Cuts a line off. Nothing if no line is complete.
std::optional<std::string_view> next_line(std::string_view& text) {
  const auto end = text.find("\r\n");
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end + 2);
  return line;
}

/// A number of more than 64 bits counts as the largest: it is beyond the end of everything.
std::optional<std::uint64_t> place_of(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (end == text.data() || end != text.data() + text.size()) return std::nullopt;
  return error == std::errc() ? number : std::numeric_limits<std::uint64_t>::max();
}

/// Whether a list, such as "a, b", has a word.
bool has_word(std::string_view list, std::string_view lower) {
  return std::ranges::any_of(split(list, ','),
                             [&](std::string_view word) { return lower_case(trimmed(word)) == lower; });
}

}  // namespace

std::optional<WebRequest> request_of(std::string_view head) {
  if (head.find('\0') != std::string_view::npos) return std::nullopt;
  const auto first = next_line(head);
  if (!first) return std::nullopt;
  const auto method_end = first->find(' '), target_end = first->rfind(' ');
  if (method_end == std::string_view::npos || target_end == method_end) return std::nullopt;
  const std::string_view target = first->substr(method_end + 1, target_end - method_end - 1);
  const std::string_view version = first->substr(target_end + 1);
  if (!target.starts_with('/') || (version != "HTTP/1.1" && version != "HTTP/1.0")) return std::nullopt;
  WebRequest request;
  request.method = first->substr(0, method_end);
  request.path = target.substr(0, target.find('?'));
  request.is_last = version == "HTTP/1.0";
  while (const auto line = next_line(head)) {
    // HTTP/1.1 requires a host, though it may be empty.
    if (line->empty()) return request.host || version == "HTTP/1.0" ? std::optional(request) : std::nullopt;
    const auto colon = line->find(':');
    // A name with blanks, or a line that goes on with the one before, may mean different things to programs.
    if (colon == std::string_view::npos ||
        line->substr(0, colon).find_first_of(" \t") != std::string_view::npos)
      return std::nullopt;
    const std::string name = lower_case(line->substr(0, colon));
    const std::string_view value = trimmed(line->substr(colon + 1));
    const auto take_once = [&](std::optional<std::string>& to) {
      const bool is_first = !to;
      to = value;
      return is_first;
    };
    if (name == "host" && !take_once(request.host)) return std::nullopt;
    if (name == "range" && !take_once(request.range)) return std::nullopt;
    if (name == "origin" && !take_once(request.origin)) return std::nullopt;
    if (name == "connection" && has_word(value, "close")) request.is_last = true;
    if (name == "transfer-encoding" || (name == "content-length" && value != "0")) request.has_body = true;
  }
  return std::nullopt;
}

AskedPart part_of(std::string_view range, std::uint64_t size) {
  using Kind = AskedPart::Kind;
  const AskedPart all{Kind::all, 0, size};
  constexpr std::string_view unit = "bytes=";
  if (lower_case(range.substr(0, unit.size())) != unit) return all;
  range.remove_prefix(unit.size());
  const auto dash = range.find('-');
  if (dash == std::string_view::npos) return all;
  const auto first = place_of(range.substr(0, dash)), last = place_of(range.substr(dash + 1));
  if (dash == 0) {
    if (!last) return all;
    if (*last == 0 || size == 0) return {Kind::none, 0, 0};
    return {Kind::part, size - std::min(*last, size), size};
  }
  const bool is_open = dash + 1 == range.size();
  if (!first || (!is_open && (!last || *last < *first))) return all;
  if (*first >= size) return {Kind::none, 0, 0};
  return {Kind::part, *first, is_open ? size : std::min(*last, size - 1) + 1};
}

}  // namespace tagrid
