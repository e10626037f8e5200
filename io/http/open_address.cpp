#include "io/http/open_address.h"

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "io/http/address.h"
#include "io/http/curl_library.h"
#include "io/http/object.h"
#include "io/http/read_ahead.h"

namespace tagrid {
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
