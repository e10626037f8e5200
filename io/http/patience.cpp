#include "io/http/patience.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {

Patience patience_with_servers() {
  // A modem has twice this, and eight requests may share it.
  constexpr std::int64_t usual = 30, most = 3600, bytes_a_second = 4096;
  std::int64_t seconds = usual;
  if (const char* given = std::getenv("TAGRID_HTTP_TIMEOUT"); given != nullptr && *given != '\0') {
    const auto number = whole_number_of(given);
    if (!number || *number < 1 || *number > most)
      throw UsageError(fmt::format("TAGRID_HTTP_TIMEOUT: {}: must be a number of seconds from 1 to {}",
                                   quoted(given), most));
    seconds = *number;
  }
  return {std::chrono::seconds(seconds),
          static_cast<std::uint64_t>(bytes_a_second * std::min(seconds, usual))};
}

bool Waiting::is_over(std::size_t bytes, std::size_t at_once, Clock::time_point now) {
  most_at_once_ = std::max(most_at_once_, at_once);
  if (!has_begun_ && bytes > 0) {
    has_begun_ = true;
    begin_ = now;
    before_ = 0;
  }
  if (now - begin_ < patience_.seconds) return false;
  if (!has_begun_ || bytes - before_ < patience_.bytes / most_at_once_) return true;
  begin_ = now;
  before_ = bytes;
  most_at_once_ = std::max<std::size_t>(at_once, 1);
  return false;
}

}  // namespace tagrid
