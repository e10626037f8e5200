#include "stages/brick/decode.h"

#include <algorithm>
#include <cassert>

#include "stages/brick/codec.h"
#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

// The samples that lie in some bytes.
template <class T>
std::span<T> samples_in(std::vector<std::byte>& bytes) {
  return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
}

}  // namespace

Status decode_brick(BrickCodeView code, const CodingParameters& parameters, BrickRequest request,
                    DecodedBrick& brick) {
  const Index3 position = parameters.bricks().position(request.id);
  const bool values_first = activity_follows_values(parameters),
             grid = request.wanted == Wanted::samples_and_grid;
  assert(request.slices > 0 && (!grid || request.slices == all_slices));
  Status status;
  std::vector<std::uint8_t> carried;
  brick = {};
  brick.id = request.id;
  const BrickGrid bricks = parameters.bricks();
  if (!parameters.stores_grid() && !code.activity.empty())
    return Status::broken("a brick has a grid, but the file stores none");
  const auto bytes_of = [&](const Box& box) {
    return std::vector<std::byte>(static_cast<std::size_t>(box.count()) * size_of(parameters.type));
  };
  with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    const auto decode_activity = [&] {
      status = decode_brick_activity<T>(code.activity, samples_in<T>(brick.samples), parameters, position,
                                        brick.active);
    };
    if (!values_first) decode_activity();
    if (!status.ok()) return;
    Box returned = bricks.owned_box(position);
    if (parameters.mode == FileMode::voxels)
      returned.high.z = returned.low.z + std::min(request.slices, returned.size().z) - 1;
    brick.samples = bytes_of(returned);
    if (parameters.mode == FileMode::grid) brick.points = bytes_of(bricks.closed_box(position));
    status = decode_brick_values<T>(code.values, brick.active, parameters, position,
                                    {samples_in<T>(brick.samples), samples_in<T>(brick.points), carried});
    if (!status.ok()) return;
    if (!carried.empty() && !(values_first && parameters.stores_grid())) {
      status = Status::broken("the values carry bytes of an activity that does not follow them");
      return;
    }
    if (!values_first || !grid || !parameters.stores_grid()) return;
    carried.insert(carried.end(), code.activity.begin(), code.activity.end());
    code.activity = carried;
    decode_activity();
  });
  if (!grid) brick.points = {};
  if (!grid) brick.active = LatticeBits();
  return status;
}

}  // namespace tagrid
