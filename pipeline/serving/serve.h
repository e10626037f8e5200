// Answers several connections at once.
#pragma once

#include "io/server/site.h"

namespace tagrid {

/// Answers what arrives at a port with bytes of the site, each connection on a thread of its own, until
/// something can be read from the descriptor `end`. Connections beyond 64 wait. Throws WorldError.
void serve(const LocalPort& port, const WebSite& site, int end);

}  // namespace tagrid
