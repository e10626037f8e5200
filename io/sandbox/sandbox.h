// Programs that parse untrusted files with large libraries run in a sandbox; see io/sandbox/confine.h.
#pragma once

#include <string>

namespace tagrid {

/// False if the environment says TAGRID_SANDBOX=off.
bool sandbox_is_on();

/// The parts of the sandbox on this machine, for users: "Landlock 7, seccomp".
std::string sandbox_in_words();

}  // namespace tagrid
