// What rank 0 tells the others to do. They wait for orders, and do each together with it.
#pragma once

#include "pipeline/parts/decode_parts.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/verify_parts.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// By rank 0: all ranks now do what the order says; rank 0 calls the function itself. Nothing happens where
/// there is one rank.
void send_order(Ranks& ranks, const PartOrder& order);    ///< make_parts()
void send_order(Ranks& ranks, const PlaceOrder& order);   ///< place_parts()
void send_order(Ranks& ranks, const DecodeOrder& order);  ///< decode_parts()
void send_order(Ranks& ranks, const VerifyOrder& order);  ///< verify_parts()
void send_order(Ranks& ranks, const Bytes& order);        ///< what the program knows: see serve()
/// By rank 0: there is no more to do; the others end with this exit code.
void dismiss(Ranks& ranks, int code);

/// By the other ranks: does what rank 0 says until it has no more orders; returns the exit code that it gave.
/// `limit_memory` is called where a limit on memory was given, `obey` does orders that are only bytes here. A
/// failure is for rank 0 to tell: `obey` throws none that rank 0 hears of.
int serve(Ranks& ranks, const std::function<void(std::uint64_t limit)>& limit_memory,
          const std::function<void(const Bytes&)>& obey);

}  // namespace tagrid
