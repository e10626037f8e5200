#include "pipeline/meshes/grid_input.h"

#include "io/files/file_attributes.h"

namespace tagrid {

GridInput::GridInput(const std::string& path, bool is_part) {
  if (is_part && is_regular_input(path))
    bricks_ = std::make_unique<TagBricks>(std::make_shared<FileSource>(path));
  else
    stream_ = std::make_unique<TagReader>(path);
}

Box GridInput::positions(const std::optional<Box>& box) const {
  const BrickGrid bricks = header().parameters.bricks();
  return bricks_ && box ? bricks_that_meet(*box, bricks)
                        : Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)});
}

void GridInput::check_memory(const Box& positions, std::uint64_t taker_bytes,
                             const Resources& resources) const {
  const CodingParameters& parameters = header().parameters;
  if (bricks_)
    threads_for_taking(parameters, positions, taker_bytes, resources);
  else
    plan_taking(parameters, taker_bytes, resources);
}

void GridInput::pass_to(GridTaker& taker, const Box& positions, std::uint64_t taker_bytes,
                        const Resources& resources, const Progress& progress) {
  if (bricks_)
    take_some(*bricks_, positions, taker_bytes, resources, taker, progress);
  else
    take_all(*stream_, taker_bytes, resources, taker, progress);
}

}  // namespace tagrid
