#include "io/tag/index.h"

#include <bit>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"

namespace tagrid {

void TagIndex::add(std::size_t activity_bytes, std::size_t value_bytes, const Statistics& brick) {
  const double mean = brick.finite == 0 ? 0 : brick.sum / static_cast<double>(brick.finite);
  bricks.push_back({static_cast<std::uint32_t>(activity_bytes), static_cast<std::uint32_t>(value_bytes),
                    brick.low, brick.high, mean});
  total.add(brick);
}

IndexForm index_form(const CodingParameters& parameters) {
  const int levels = parameters.stores_grid() ? max_level(parameters.cube_size) + 1 : 0;
  return {levels, is_float_type(parameters.type), parameters.mesh_error >= 0};
}

std::uint64_t index_size(std::uint64_t bricks, const IndexForm& form) {
  const auto of_levels = static_cast<std::uint64_t>(form.levels) * 8;
  return bricks * (2 * 4 + 3 * 8) + of_levels + 7 * 8 + (form.mesh ? 8 : 0);
}

std::vector<std::byte> serialize_index(const TagIndex& index, const IndexForm& form) {
  FieldWriter fields;
  for (int level = 0; level < form.levels; ++level)
    fields.put(index.total.active[static_cast<std::size_t>(level)]);
  fields.put(index.total.max_error);
  if (form.mesh) fields.put(index.total.mesh_error);
  if (form.floats) {
    fields.put(index.total.sum_squared_real);
    fields.put(std::uint64_t{0});
  } else {
    fields.put(static_cast<std::uint64_t>(index.total.sum_squared_error));
    fields.put(static_cast<std::uint64_t>(index.total.sum_squared_error >> 64));
  }
  fields.put(index.total.low);
  fields.put(index.total.high);
  fields.put(index.total.sum);
  fields.put(index.total.finite);
  // Stored by columns, which compress better.
  for (const auto& brick : index.bricks) fields.put(brick.activity_bytes);
  for (const auto& brick : index.bricks) fields.put(brick.value_bytes);
  for (const auto& brick : index.bricks) fields.put(brick.low);
  for (const auto& brick : index.bricks) fields.put(brick.high);
  for (const auto& brick : index.bricks) fields.put(brick.mean);
  return std::move(fields.bytes());
}

Status parse_index(std::span<const std::byte> bytes, std::uint64_t bricks, const IndexForm& form,
                   TagIndex& index) {
  if (bytes.size() != index_size(bricks, form))
    return Status::broken("the size of the index does not fit the number of bricks");
  FieldReader reader(bytes);
  index.total = {};
  for (int level = 0; level < form.levels; ++level)
    index.total.active[static_cast<std::size_t>(level)] = reader.get<std::uint64_t>();
  index.total.max_error = reader.get<double>();
  if (form.mesh) index.total.mesh_error = reader.get<double>();
  const auto low_half = reader.get<std::uint64_t>(), high_half = reader.get<std::uint64_t>();
  if (form.floats && high_half != 0) return Status::broken("the index has bits that must be 0");
  if (form.floats)
    index.total.sum_squared_real = std::bit_cast<double>(low_half);
  else
    index.total.sum_squared_error = Uint128{high_half} << 64 | low_half;
  index.total.low = reader.get<double>();
  index.total.high = reader.get<double>();
  index.total.sum = reader.get<double>();
  index.total.finite = reader.get<std::uint64_t>();
  index.bricks.assign(memory_size(bricks), {});
  for (auto& brick : index.bricks) brick.activity_bytes = reader.get<std::uint32_t>();
  for (auto& brick : index.bricks) brick.value_bytes = reader.get<std::uint32_t>();
  for (auto& brick : index.bricks) brick.low = reader.get<double>();
  for (auto& brick : index.bricks) brick.high = reader.get<double>();
  for (auto& brick : index.bricks) brick.mean = reader.get<double>();
  return {};
}

}  // namespace tagrid
