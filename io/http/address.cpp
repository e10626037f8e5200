#include "io/http/address.h"

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "io/http/curl_library.h"
#include "io/http/object.h"
#include "io/http/read_ahead.h"
#include "io/text/addresses.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// The first of these environment variables that is set and not empty.
std::string variable(std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const char* value = std::getenv(name); value != nullptr && *value != '\0') return value;
  return "";
}

bool is_letter_or_digit(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c); }

bool is_bucket(std::string_view name) {
  // A name of dots would be a step in a path.
  return name.size() >= 3 && name.size() <= 63 && is_letter_or_digit(name.front()) &&
         is_letter_or_digit(name.back()) && name.find("..") == name.npos &&
         std::ranges::all_of(
             name, [](char c) { return is_letter_or_digit(c) || c == '-' || c == '.' || c == '_'; });
}

Address object_at(const std::string& text, const std::string& name) {
  const std::string_view rest = std::string_view(text).substr(std::string_view("s3://").size());
  const std::size_t slash = rest.find('/');
  const std::string_view bucket = rest.substr(0, slash), key = rest.substr(std::min(slash, rest.size()));
  if (!is_bucket(bucket) || key.size() < 2) throw UsageError(name + ": must be s3://BUCKET/KEY");
  if (is_signed_address(key))
    throw UsageError(name +
                     ": has a signature, which addresses of s3:// do not have; use its https:// address");
  Address address;
  address.name = name;
  address.is_object = true;
  address.key = variable({"AWS_ACCESS_KEY_ID"});
  address.secret = variable({"AWS_SECRET_ACCESS_KEY"});
  address.token = variable({"AWS_SESSION_TOKEN"});
  address.region = variable({"AWS_REGION", "AWS_DEFAULT_REGION"});
  if (address.key.empty() != address.secret.empty())
    throw UsageError(name + ": AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY need each other");
  if (address.region.empty()) address.region = "us-east-1";
  std::string server = variable({"AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"});
  while (server.ends_with('/')) server.pop_back();
  if (!server.empty() && (!is_address(server) || server.starts_with("s3")))
    throw UsageError(name + ": AWS_ENDPOINT_URL must begin with http:// or https://");
  // What follows a question mark would be no path.
  if (server.find_first_of("?#") != server.npos)
    throw UsageError(name + ": AWS_ENDPOINT_URL must be the address of a server, without ? and #");
  const std::string path = percent_encoded(key, "/"), host = "s3." + address.region + ".amazonaws.com";
  // A name with dots does not fit the certificate of the server.
  const bool is_host = bucket.find_first_of("._") == bucket.npos;
  if (!server.empty())
    address.url = server + "/" + std::string(bucket) + path;
  else if (is_host)
    address.url = "https://" + std::string(bucket) + "." + host + path;
  else
    address.url = "https://" + host + "/" + std::string(bucket) + path;
  return address;
}

}  // namespace

Address address_of(const std::string& text) {
  const std::string name = shown_address(text);
  if (name.starts_with("s3://")) return object_at(text, name);
  Address address;
  address.name = name;
  address.url = text;
  return address;
}

namespace {

// The header, and all of a small file.
constexpr std::size_t first_bytes = std::size_t{64} << 10;

std::shared_ptr<const ByteSource> open_address(const Address& address) {
  const auto object = std::make_shared<Object>(address);
  std::vector<std::byte> beginning = object->open(first_bytes);
  return std::make_shared<ReadAhead>(
      address.name, object->version().size, std::move(beginning),
      [object](std::uint64_t position, std::span<std::byte> to) { object->read(position, to); });
}

}  // namespace

std::string declare_address(const std::string& text) {
  const Address address = address_of(text);
  // Names are without what follows a question mark, so two addresses may have one.
  static std::mutex mutex;
  static std::map<std::string, std::string> urls;
  {
    const std::lock_guard lock(mutex);
    if (const auto [known, is_new] = urls.emplace(address.name, address.url);
        !is_new && known->second != address.url)
      throw UsageError(address.name +
                       ": two addresses differ only in parts that are not shown, such as the part after a "
                       "question mark; give only one of them in a run");
  }
  declare_source(address.name, memory_of_curl + ReadAhead::kept_bytes + first_bytes,
                 [address] { return open_address(address); });
  return address.name;
}

}  // namespace tagrid
