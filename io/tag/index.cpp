#include "io/tag/index.h"

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"

namespace tagrid {
namespace {

/// The fields of an index, for a FieldWriter or a FieldReader. `zero` follows the squared errors of floats.
void index_fields(auto& fields, auto& index, const IndexForm& form, auto& zero) {
  auto& total = index.total;
  for (int level = 0; level < form.levels; ++level)
    fields.field(total.active[static_cast<std::size_t>(level)]);
  fields.field(total.max_error);
  if (form.mesh) fields.field(total.mesh_error);
  if (form.floats) {
    fields.field(total.sum_squared_real);
    fields.field(zero);
  } else {
    field_128(fields, total.sum_squared_error);
  }
  for (auto* number : {&total.low, &total.high, &total.sum}) fields.field(*number);
  fields.field(total.finite);
  // Stored by columns, which compress better.
  for (auto& brick : index.bricks) fields.field(brick.activity_bytes);
  for (auto& brick : index.bricks) fields.field(brick.value_bytes);
  for (auto& brick : index.bricks) fields.field(brick.low);
  for (auto& brick : index.bricks) fields.field(brick.high);
  for (auto& brick : index.bricks) fields.field(brick.mean);
}

}  // namespace

void TagIndex::add(std::size_t activity_bytes, std::size_t value_bytes, const Statistics& brick) {
  const double mean = brick.finite == 0 ? 0 : brick.sum / static_cast<double>(brick.finite);
  bricks.push_back({static_cast<std::uint32_t>(activity_bytes), static_cast<std::uint32_t>(value_bytes),
                    brick.low, brick.high, mean});
  total.add(brick);
}

IndexForm index_form(const CodingParameters& parameters) {
  const int levels = parameters.counts_points() ? max_level(parameters.cube_size) + 1 : 0;
  return {levels, is_float_type(parameters.type), parameters.mesh_error >= 0};
}

std::uint64_t index_size(std::uint64_t bricks, const IndexForm& form) {
  const auto of_levels = static_cast<std::uint64_t>(form.levels) * 8;
  return bricks * (2 * 4 + 3 * 8) + of_levels + 7 * 8 + (form.mesh ? 8 : 0);
}

std::vector<std::byte> serialize_index(const TagIndex& index, const IndexForm& form) {
  FieldWriter fields;
  const std::uint64_t zero = 0;
  index_fields(fields, index, form, zero);
  return std::move(fields.bytes());
}

Status parse_index(std::span<const std::byte> bytes, std::uint64_t bricks, const IndexForm& form,
                   TagIndex& index) {
  if (bytes.size() != index_size(bricks, form))
    return Status::broken("the size of the index does not fit the number of bricks");
  FieldReader reader(bytes);
  index.total = {};
  index.bricks.assign(memory_size(bricks), {});
  std::uint64_t zero = 0;
  index_fields(reader, index, form, zero);
  if (zero != 0) return Status::broken("the index has bits that must be 0");
  return {};
}

}  // namespace tagrid
