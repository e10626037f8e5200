#include "pipeline/parts/mesh_parts.h"

#include <algorithm>
#include <map>
#include <optional>

#include "pipeline/materials/bricks.h"
#include "pipeline/parts/order_members.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/ranks/messages.h"

namespace tagrid {
namespace {

constexpr std::size_t bytes_of_message = std::size_t{1} << 24;

/// A piece of a brick, which its rank sends in order.
struct BrickPiece {
  std::int64_t brick = 0;
  std::uint64_t size = 0;  ///< of the entire brick
  Bytes bytes;
};
TAGRID_MEMBERS(BrickPiece, brick, size, bytes)

// Layers are dealt out like cards, so that no rank has only empty ones.
void make_own_layers(const Ranks& ranks, const MeshOrder& order, BrickSpool& bricks) {
  const MaterialMeshInputs inputs(order.input, order.volume, order.options.label_volume);
  const MaterialMeshJob job = settle_material_mesh(inputs.samples(), inputs.geometry(), order.options);
  const std::vector<MeshLayer> layers = layers_of(job);
  const int threads =
      memory_for_mesh(inputs.samples().parameters(), job, layers, of_this_rank(ranks, order.resources), 0)
          .threads;
  MaterialBricks maker(inputs.samples(), job, layers, threads, {});
  const auto count = static_cast<std::size_t>(ranks.count());
  for (auto layer = static_cast<std::size_t>(ranks.rank()); layer < layers.size(); layer += count)
    maker.make(layer,
               [&](std::int64_t number, const BrickMesh& brick) { bricks.add(number, bytes_of(brick)); });
}

void tell(Ranks& ranks, BrickSpool& bricks) {
  for (const std::int64_t number : bricks.numbers()) {
    const Bytes all = bricks.bytes(number);
    for (std::size_t first = 0; first < all.size(); first += bytes_of_message) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
      const auto end =
          all.begin() + static_cast<std::ptrdiff_t>(std::min(first + bytes_of_message, all.size()));
      ranks.tell(packed_order(BrickPiece{number, all.size(), Bytes(begin, end)}));
    }
  }
}

}  // namespace

void mesh_parts(Ranks& ranks, const MeshOrder& order, BrickSpool& bricks) {
  all_do(ranks, [&] { make_own_layers(ranks, order, bricks); });
  std::exception_ptr failure;
  std::map<std::int64_t, Bytes> incomplete;
  try {
    if (ranks.rank() > 0) tell(ranks, bricks);
  } catch (...) {
    failure = std::current_exception();
  }
  ranks.listen_to_the_end([&](const Bytes& message) {
    if (failure) return;
    try {
      auto piece = unpacked_order<BrickPiece>(message);
      Bytes& brick = incomplete[piece.brick];
      brick.insert(brick.end(), piece.bytes.begin(), piece.bytes.end());
      if (brick.size() < piece.size) return;
      bricks.add(piece.brick, brick);
      incomplete.erase(piece.brick);
    } catch (...) {
      failure = std::current_exception();
    }
  });
  agree(ranks, failure);
}

Finished<MaterialMeshResult> write_material_mesh(Ranks& ranks, const MaterialMeshRun& run) {
  if (ranks.count() == 1) return write_material_mesh(run);
  return write_material_mesh(run, [&](BrickSpool& bricks) {
    const MeshOrder order{run.input, run.volume, run.options, run.resources};
    send_order(ranks, order);
    mesh_parts(ranks, order, bricks);
  });
}

}  // namespace tagrid
