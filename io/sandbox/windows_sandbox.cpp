#include "io/errors/errors.h"
#include "io/sandbox/sandbox.h"

namespace tagrid {

bool sandbox_is_on() { return false; }

std::string sandbox_in_words() { return "none on Windows"; }

void confine_to(const std::string&, const FilesBeside&, const std::string&) {
  throw WorldError("there is no sandbox on Windows, without which tagrid starts no reader");
}

int landlock_version() { return 0; }
void allow_reading_only(const Readable&) {}
void allow_calls_of_readers() {}

}  // namespace tagrid
