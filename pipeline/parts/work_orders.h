// Orders that rank 0 sends. The other ranks wait for orders and carry out each one together with rank 0.
#pragma once

#include <optional>
#include <string>

#include "io/envelope/envelope.h"
#include "pipeline/decode/values.h"
#include "pipeline/memory/resources.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/ranks/ranks.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

struct DecodeOrder {
  std::string input;
  std::string file;         ///< the file that the samples are written into; it gets its name later
  std::string name;         ///< its final name, for messages
  std::uint64_t start = 0;  ///< the byte at which the samples begin
  WrittenNumbers numbers = {};
  Resources resources{0};  ///< per rank; 0 threads: all that the rank may use
};

/// Collective. Decodes the parts and writes their samples.
void decode_parts(Ranks& ranks, const DecodeOrder& order, const Progress& progress = {});

/// Some files of a source, of whose content each rank looks at a share.
struct ContentOrder {
  SourceFiles source;
  std::vector<std::string> paths;  ///< of the files of the source, which each rank opens
  bool exact = false;              ///< see look_at_content()
  Resources resources{0};          ///< per rank
};

/// Looks at the content of all files of a source, on all ranks. Called by rank 0; the others call serve().
/// The result does not depend on ranks and threads. Throws as look_at_content() does.
void share_contents(Ranks& ranks, SourceFiles& source, bool exact, const Resources& resources);

/// Collective: looks at the content of some files; on rank 0, `order` then has that of all of them.
void look_at_share(Ranks& ranks, ContentOrder& order);

struct MeshOrder;

struct VerifyOrder {
  std::string input;
  std::optional<std::string> original;
  SourceDescription source;
  Resources resources{0};  ///< per rank; 0 threads: all that the rank may use
};

/// Collective. Verifies the parts; rank 0 also the totals of the index. `setup`: of this rank, if known.
VerifyResult verify_parts(Ranks& ranks, const VerifyOrder& order, std::optional<VerifySetup> setup = {},
                          const Progress& progress = {});

/// Rank 0 sends an order, and then calls the function itself. With one rank, nothing is sent.
void send_order(Ranks& ranks, const PartOrder& order);     ///< make_parts()
void send_order(Ranks& ranks, const PlaceOrder& order);    ///< place_parts()
void send_order(Ranks& ranks, const DecodeOrder& order);   ///< decode_parts()
void send_order(Ranks& ranks, const VerifyOrder& order);   ///< verify_parts()
void send_order(Ranks& ranks, const ContentOrder& order);  ///< look_at_share()
void send_order(Ranks& ranks, const MeshOrder& order);     ///< mesh_parts()
void send_order(Ranks& ranks, const Bytes& order);         ///< an order of the program; see serve()
/// Called by rank 0 when there is no more work. The other ranks end with this exit code.
void dismiss(Ranks& ranks, int code);

/// Called by the other ranks: carries out the orders of rank 0 until there are no more, and returns the exit
/// code that it sent. `limit_memory` is called with any limit on memory. `obey` handles the orders of the
/// program. Rank 0 reports failures: `obey` must not throw an exception that rank 0 also receives.
int serve(Ranks& ranks, const std::function<void(std::uint64_t limit)>& limit_memory,
          const std::function<void(const Bytes&)>& obey);

}  // namespace tagrid
