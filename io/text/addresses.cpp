#include "io/text/addresses.h"

#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::string_view slashes = "://";

}  // namespace

bool is_address(std::string_view text) {
  const std::string scheme = lower_case(text.substr(0, text.find(slashes)));
  return text.find(slashes) != text.npos && (scheme == "http" || scheme == "https" || scheme == "s3");
}

std::string shown_address(std::string_view text) {
  if (!is_address(text)) return std::string(text);
  const std::size_t begin = text.find(slashes) + slashes.size();
  const std::string scheme = lower_case(text.substr(0, begin));
  std::string_view rest = text.substr(begin);
  // The key of an object may contain any characters, and has no secrets.
  if (scheme == "s3://") return scheme + std::string(rest);
  rest = rest.substr(0, rest.find_first_of("?#"));
  // The last @ before the path; a password with a slash would end there, and must not be shown either.
  const std::size_t path = rest.find('/');
  if (const std::size_t at = rest.substr(0, path).rfind('@'); at != rest.npos)
    rest.remove_prefix(at + 1);
  else if (const std::size_t colon = rest.find(':'); colon < path && rest.find('@') != rest.npos)
    for (const char c : rest.substr(colon + 1, path - colon - 1))
      if (!is_digit(c)) {
        rest.remove_prefix(rest.rfind('@') + 1);
        break;
      }
  return scheme + std::string(rest);
}

}  // namespace tagrid
