#include "pipeline/verify/part_verifier.h"

#include <fmt/format.h>

#include "io/errors/errors.h"
#include "pipeline/decode/graph.h"

namespace tagrid {

PartVerifier::PartVerifier(const TagBricks& file, VerifySetup setup)
    : file_(file), checks_(file.name(), file.header(), file.index(), std::move(setup)) {}

Findings PartVerifier::verify(const BrickRows& rows, const Watch& watch) {
  return checks_.verify(
      rows, [&](const BrickRows& wanted) { return bricks_of(wanted); }, watch);
}

void PartVerifier::tell_difference(const Disagreement& bricks) const {
  const BrickGrid grid = parameters().bricks();
  SharedFaces faces(parameters());
  for (const std::int64_t id : {bricks.below, bricks.above}) {
    const Index3 position = grid.position(id);
    const BrickRows row = {position.y, position.y + 1, position.z, position.z + 1};
    DecodeStreams streams;
    streams.bricks = bricks_of(row);
    streams.write_rows = [](const DecodedRows&) {};
    streams.inspect_brick = [&](const DecodedBrick& brick) {
      if (brick.id != id) return;
      if (const auto p = faces.first_difference(brick))
        checks_.fail_brick(brick.id, "it disagrees with its neighbor", *p);
    };
    run_decode_graph(parameters(), row, checks_.budget(), streams);
  }
  throw WorldError(
      fmt::format("{}: bricks {} and {} changed while they were read; is the file being written to?",
                  file_.name(), bricks.below, bricks.above));
}

}  // namespace tagrid
