#include "io/sandbox/sandbox.h"

#include <fmt/format.h>

#include <cstdlib>
#include <string_view>

#include "io/sandbox/landlock.h"

namespace tagrid {
namespace {

#ifdef TAGRID_SANITIZED
constexpr bool can_confine = false;  // sanitizers write reports, and start programs for them
#else
constexpr bool can_confine = true;
#endif

}  // namespace

bool sandbox_is_on() {
  const char* wanted = std::getenv("TAGRID_SANDBOX");
  return can_confine && (wanted == nullptr || std::string_view(wanted) != "off");
}

std::string sandbox_in_words() {
  if (!sandbox_is_on()) return "off";
  const int version = landlock_version();
  return version == 0 ? "seccomp (this kernel has no Landlock, so files are not protected)"
                      : fmt::format("Landlock {}, seccomp", version);
}

}  // namespace tagrid
