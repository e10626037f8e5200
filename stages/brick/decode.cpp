#include "stages/brick/decode.h"

#include "stages/brick/codec.h"
#include "stages/volume/sample_type.h"

namespace tagrid {
namespace {

template <class T>
std::vector<std::byte> bytes_of(const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

Status decode_brick(std::span<const std::uint8_t> activity, std::span<const std::uint8_t> values,
                    const CodingParameters& parameters, std::int64_t id, Wanted wanted, DecodedBrick& brick) {
  const Index3 position = parameters.bricks().position(id);
  const bool values_first = activity_follows_values(parameters), grid = wanted == Wanted::samples_and_grid;
  Status status;
  brick.id = id;
  with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    std::vector<T> samples, points;
    const auto decode_activity = [&] {
      status = decode_brick_activity<T>(activity, samples, parameters, position, brick.active);
    };
    if (!values_first) decode_activity();
    if (!status.ok()) return;
    status = decode_brick_values<T>(values, brick.active, parameters, position, samples, points);
    if (!status.ok()) return;
    if (values_first && grid) decode_activity();
    brick.samples = bytes_of(samples);
    if (grid) brick.points = bytes_of(points);
  });
  if (!grid) brick.active = LatticeBits();
  return status;
}

}  // namespace tagrid
