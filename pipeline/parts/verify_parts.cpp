#include "pipeline/parts/work_orders.h"

#include <memory>
#include <utility>

#include "io/tag/bricks.h"
#include "pipeline/parts/order_members.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/ranks/messages.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

VerifyResult verify_parts(Ranks& ranks, const VerifyOrder& order, std::optional<VerifySetup> setup,
                          const Progress& progress) {
  std::optional<TagBricks> file;
  std::optional<Verifier> verifier;
  all_do(ranks, [&] {
    file.emplace(std::make_shared<FileSource>(order.input));
    if (!setup)
      setup = verify_setup(file->name(), file->parameters(), order.original, order.source,
                           of_this_rank(ranks, order.resources));
    verifier.emplace(*file, std::move(*setup));
  });
  const BrickGrid bricks = verifier->parameters().bricks();
  const std::vector<BrickRows> parts = parts_of(bricks);
  Statistics counted;
  OpenFacePairs faces(bricks);
  SharedWork shared;
  shared.count = static_cast<std::int64_t>(parts.size());
  shared.work = [&](std::int64_t part) {
    shared.account = packed_order(verifier->verify(parts[static_cast<std::size_t>(part)], watch_of(shared)));
  };
  shared.take = [&](const Bytes& bytes) {
    const auto found = unpacked_order<Findings>(bytes);
    counted.add(found.counted);
    faces.add(found.open_faces);
  };
  shared.look = look_for(progress, verifier->parameters());
  share_out(ranks, shared);
  if (ranks.rank() > 0) return {};
  if (const auto bricks_that_differ = faces.first_difference())
    verifier->tell_difference(*bricks_that_differ);
  return verifier->finish(counted, file->sizes());
}

}  // namespace tagrid
