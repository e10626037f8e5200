// Orders that rank 0 sends. The other ranks wait for orders and carry out each one together with rank 0.
#pragma once

#include "pipeline/parts/decode_parts.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/source_contents.h"
#include "pipeline/parts/verify_parts.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Called by rank 0, which then calls the function itself. The other ranks carry out the order. With one
/// rank, nothing happens.
void send_order(Ranks& ranks, const PartOrder& order);     ///< make_parts()
void send_order(Ranks& ranks, const PlaceOrder& order);    ///< place_parts()
void send_order(Ranks& ranks, const DecodeOrder& order);   ///< decode_parts()
void send_order(Ranks& ranks, const VerifyOrder& order);   ///< verify_parts()
void send_order(Ranks& ranks, const ContentOrder& order);  ///< look_at_share()
void send_order(Ranks& ranks, const Bytes& order);         ///< an order of the program; see serve()
/// Called by rank 0 when there is no more work. The other ranks end with this exit code.
void dismiss(Ranks& ranks, int code);

/// Called by the other ranks: carries out the orders of rank 0 until there are no more, and returns the exit
/// code that rank 0 sent. `limit_memory` is called if a limit on memory was given. `obey` handles the orders
/// of the program, which are only bytes here. Rank 0 reports failures: `obey` must not throw an exception
/// that rank 0 also receives.
int serve(Ranks& ranks, const std::function<void(std::uint64_t limit)>& limit_memory,
          const std::function<void(const Bytes&)>& obey);

}  // namespace tagrid
