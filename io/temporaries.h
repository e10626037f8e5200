// The names of the temporary files that exist, for a signal handler that ends the program.
#pragma once

#include <string>

namespace tagrid {

/// Remembers the name of a temporary file; returns where, for forget_temporary(). A file beyond some number
/// is not known to a signal handler, and works otherwise. With `original`: `path` is the older file of that
/// name, which gets it back.
int register_temporary(const std::string& path, const std::string& original = "");
void forget_temporary(int slot);

/// Six letters that make a name another one.
std::string random_suffix();

/// Removes every temporary that is registered, and gives older files their names back. Async-signal-safe: for
/// a signal handler that ends the program.
void unlink_temporaries() noexcept;

}  // namespace tagrid
