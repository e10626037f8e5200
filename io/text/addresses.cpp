#include "io/text/addresses.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::string_view slashes = "://";

}  // namespace

bool is_address(std::string_view text) {
  const std::string scheme = lower_case(text.substr(0, text.find(slashes)));
  return text.find(slashes) != text.npos && (scheme == "http" || scheme == "https" || scheme == "s3");
}

bool has_scheme(std::string_view text) {
  const std::string scheme = lower_case(text.substr(0, text.find(":/")));
  return scheme.size() < text.size() && scheme.size() > 1 && scheme[0] >= 'a' && scheme[0] <= 'z' &&
         scheme.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789+-.") == scheme.npos;
}

bool is_signed_address(std::string_view text) {
  const std::size_t query = text.find('?');
  const std::string lower = lower_case(query == text.npos ? "" : text.substr(query));
  return lower.find("signature=") != lower.npos;
}

std::string shown_address(std::string_view text) {
  if (!has_scheme(text)) return std::string(text);
  const std::size_t begin = is_address(text)
                                ? text.find(slashes) + slashes.size()
                                : std::min(text.find_first_not_of('/', text.find(":/") + 1), text.size());
  const std::string scheme = lower_case(text.substr(0, begin));
  std::string_view rest = text.substr(begin);
  if (scheme == "s3://") {
    // The key of an object may contain any characters, and has no secrets. A user or a signature is a mistake.
    if (rest.substr(0, rest.find('/')).find_first_of(":@") != rest.npos)
      rest.remove_prefix(rest.rfind('@') + 1);
    if (is_signed_address(rest)) rest = rest.substr(0, rest.find('?'));
    return scheme + std::string(rest);
  }
  // A password with one of these characters ends too early, and must not be shown either.
  const std::string_view host = rest.substr(0, rest.find_first_of("/?#"));
  const std::size_t colon = host.rfind(':');
  const bool has_port =
      colon == host.npos || host.ends_with(']') || std::ranges::all_of(host.substr(colon + 1), is_digit);
  const std::size_t at = has_port || host.find('@') != host.npos ? host.rfind('@') : rest.rfind('@');
  if (at != rest.npos) rest.remove_prefix(at + 1);
  rest = rest.substr(0, rest.find_first_of("?#"));
  return scheme + std::string(rest);
}

std::string percent_encoded(std::string_view text, std::string_view kept) {
  constexpr std::string_view plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
  std::string encoded;
  for (const char c : text)
    if (plain.find(c) != plain.npos || kept.find(c) != kept.npos)
      encoded += c;
    else
      encoded += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  return encoded;
}

}  // namespace tagrid
