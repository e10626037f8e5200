#include <cstdlib>

#include "io/errors/errors.h"
#include "io/sandbox/sandbox.h"

namespace tagrid {

bool sandbox_is_on() {
  const char* wanted = std::getenv("TAGRID_SANDBOX");
  return wanted == nullptr || std::string_view(wanted) != "off";
}

std::string sandbox_in_words() {
  return sandbox_is_on() ? "none on Windows, so readers open no file unless TAGRID_SANDBOX=off" : "off";
}

void confine_to(const std::string& path, const FilesBeside&, const std::string&) {
  if (sandbox_is_on())
    throw WorldError(
        "{}: is not read, because Windows has no sandbox for the program that reads it; if you trust the "
        "file, set "
        "TAGRID_SANDBOX=off",
        path);
}

int landlock_version() { return 0; }
void allow_reading_only(const Readable&) {}
void allow_calls_of_readers() {}

}  // namespace tagrid
