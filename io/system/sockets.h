// Connections from programs of this machine. What is sent goes through send_bytes() in processes.h.
#pragma once

#include <chrono>
#include <cstddef>
#include <span>

#include "io/system/files.h"

namespace tagrid {

/// Opens a port of 127.0.0.1, on which connections wait; 0: one that the system chooses, whose number
/// replaces it. Negative on failure; errno says why. It does not block.
Descriptor open_local_port(int& number);
/// The next connection that waits; negative if there is none.
Descriptor accept_connection(int port);
/// A call on the connection that waits so long fails.
void set_patience(int connection, std::chrono::seconds longest);
/// Returns the number of bytes, 0 at the end.
std::ptrdiff_t receive_bytes(int connection, std::span<char> to);
/// From now on, nothing is received.
void end_receiving(int connection);
/// From now on, nothing is sent or received.
void end_connection(int connection);

}  // namespace tagrid
