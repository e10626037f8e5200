// Answers several connections at once.
#pragma once

#include <functional>

#include "io/server/site.h"

namespace tagrid {

/// Answers what arrives at a port with bytes of the site, each connection on a thread of its own, until
/// something can be read from the descriptor `end`. Connections beyond 64 wait until another one ends; the one
/// that has waited longest for a request, for a second at least, is ended for them. Then calls `ended`, and
/// waits for answers that are being computed. Throws WorldError.
void serve(const LocalPort& port, const WebSite& site, int end, const std::function<void()>& ended);

}  // namespace tagrid
