#include "pipeline/verify_parts.h"

#include <algorithm>

#include "pipeline/order_fields.h"
#include "pipeline/parts.h"
#include "pipeline/work_orders.h"

namespace tagrid {

// What is not counted by a verification is not there.
template <class Fields, class Order>
requires std::is_same_v<std::remove_const_t<Order>, Findings>
void describe(Fields& fields, Order& found) {
  auto& counted = found.counted;
  for (auto& points : counted.active) fields(points);
  fields(counted.samples);
  fields(counted.max_error);
  fields(counted.mesh_error);
  auto low = static_cast<std::uint64_t>(counted.sum_squared_error),
       high = static_cast<std::uint64_t>(counted.sum_squared_error >> 64);
  fields(low);
  fields(high);
  if constexpr (!std::is_const_v<Order>) counted.sum_squared_error = Uint128{high} << 64 | low;
  fields(counted.sum_squared_real);
  const std::size_t count = fields.size(found.open_faces);
  for (std::size_t i = 0; i < count; ++i) {
    fields(found.open_faces[i].below);
    fields(found.open_faces[i].axis);
    fields(found.open_faces[i].checksum);
  }
}

VerifyResult verify_parts(Ranks& ranks, const VerifyOrder& order, std::unique_ptr<Verifier> verifier,
                          const DoneBytes& progress) {
  all_do(ranks, [&] {
    if (!verifier)
      verifier = std::make_unique<Verifier>(order.input, order.original, order.source,
                                            of_this_rank(order.resources));
    verifier->begin_any_order();
  });
  const BrickGrid bricks = verifier->parameters().bricks();
  const std::vector<BrickRows> parts = parts_of(bricks);
  Statistics counted;
  OpenFacePairs faces(bricks);
  SharedWork shared;
  shared.count = static_cast<std::int64_t>(parts.size());
  shared.work = [&](std::int64_t part) {
    shared.account =
        packed_order(verifier->verify(parts[static_cast<std::size_t>(part)], [&](std::uint64_t bytes) {
          if (shared.stop) throw Stopped();
          shared.done += static_cast<std::int64_t>(bytes);
        }));
  };
  shared.take = [&](const Bytes& bytes) {
    const auto found = unpacked_order<Findings>(bytes);
    counted.add(found.counted);
    faces.add(found.open_faces);
  };
  if (progress)
    shared.look = [&](const SharedNumbers& numbers) { progress(static_cast<std::uint64_t>(numbers.done)); };
  share_out(ranks, shared);
  if (ranks.rank() > 0) return {};
  if (const auto bricks_that_differ = faces.first_difference())
    verifier->tell_difference(*bricks_that_differ);
  return verifier->finish(counted);
}

VerifyResult verify_by_ranks(Ranks& ranks, const std::string& input, const std::string& original,
                             const SourceDescription& source, const Resources& resources,
                             const Progress& progress) {
  auto verifier = std::make_unique<Verifier>(input, original, source, of_this_rank(resources));
  if (ranks.count() == 1 || !verifier->any_order()) return verify_all(*verifier, progress);
  const std::uint64_t total = sample_bytes(verifier->parameters().dims, verifier->parameters().type).value();
  const VerifyOrder order{input, original, source, resources};
  send_order(ranks, order);
  return verify_parts(ranks, order, std::move(verifier), [&](std::uint64_t done) {
    if (progress) progress(std::min(done, total), total);
  });
}

}  // namespace tagrid
