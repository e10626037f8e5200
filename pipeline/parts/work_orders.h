// Orders of rank 0 to the other ranks, which wait for orders and obey each together with rank 0.
#pragma once

#include "pipeline/parts/decode_parts.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/verify_parts.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Called by rank 0: all other ranks now do what the order says; rank 0 calls the function itself. With one
/// rank, nothing happens.
void send_order(Ranks& ranks, const PartOrder& order);    ///< make_parts()
void send_order(Ranks& ranks, const PlaceOrder& order);   ///< place_parts()
void send_order(Ranks& ranks, const DecodeOrder& order);  ///< decode_parts()
void send_order(Ranks& ranks, const VerifyOrder& order);  ///< verify_parts()
void send_order(Ranks& ranks, const Bytes& order);        ///< known to the program; see serve()
/// Called by rank 0: there is no more work; the other ranks end with this exit code.
void dismiss(Ranks& ranks, int code);

/// Called by the other ranks: obeys the orders of rank 0 until there are no more, and returns the exit code
/// that rank 0 gave. `limit_memory` is called if a limit on memory was given; `obey` handles orders that are
/// only bytes here. Rank 0 reports failures: `obey` must not throw one of which rank 0 hears.
int serve(Ranks& ranks, const std::function<void(std::uint64_t limit)>& limit_memory,
          const std::function<void(const Bytes&)>& obey);

}  // namespace tagrid
