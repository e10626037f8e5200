// What JavaScript calls to find bricks.
#include "glue.h"

#include <cstddef>
#include <cstdint>

namespace {

constexpr std::size_t numbers_of_block = 12;

void put(double*& to, double value) { *to++ = value; }

}  // namespace

EXPORTED tagrid_blocks* web_create(double file_bytes) {
  tagrid_blocks* blocks = nullptr;
  tagrid_blocks_create(static_cast<std::uint64_t>(file_bytes), &blocks);
  return blocks;
}

EXPORTED const char* web_message(const tagrid_blocks* blocks) { return tagrid_blocks_message(blocks); }
EXPORTED const char* web_metadata(const tagrid_blocks* blocks) { return tagrid_blocks_metadata(blocks); }
EXPORTED int web_open(tagrid_blocks* blocks) { return tagrid_blocks_open(blocks); }

// How many ranges the last call lacked.
EXPORTED std::size_t web_needs(const tagrid_blocks* blocks) {
  const tagrid_range* ranges = nullptr;
  return tagrid_blocks_needs(blocks, &ranges);
}

// One of them: its offset and its bytes.
EXPORTED void web_need(const tagrid_blocks* blocks, std::size_t number, double* to) {
  const tagrid_range* ranges = nullptr;
  if (number >= tagrid_blocks_needs(blocks, &ranges)) return;
  put(to, static_cast<double>(ranges[number].offset));
  put(to, static_cast<double>(ranges[number].bytes));
}

EXPORTED int web_give(tagrid_blocks* blocks, double offset, const void* bytes, std::size_t count) {
  return tagrid_blocks_give(blocks, static_cast<std::uint64_t>(offset), bytes, count);
}

// 3 dims, type, 3 + 3 + 9 numbers of the geometry and whether each is known, 3 bounds, 3 achieved ones, the
// range, the edge of a brick, lead, whether the grid is stored, volumes, and factors of overviews up to a 0:
// room for 35 + TAGRID_MOST_OVERVIEWS numbers.
EXPORTED int web_info(tagrid_blocks* blocks, double* to) {
  tagrid_info info;
  tagrid_info_init(&info);
  std::int64_t factors[TAGRID_MOST_OVERVIEWS], volumes = 0;
  int status = tagrid_blocks_info(blocks, &info);
  if (status == TAGRID_OK) status = tagrid_blocks_overviews(blocks, factors);
  if (status == TAGRID_OK) status = tagrid_blocks_volumes(blocks, &volumes);
  if (status != TAGRID_OK) return status;
  for (const std::int64_t dim : info.dims) put(to, static_cast<double>(dim));
  put(to, info.type);
  const tagrid_geometry& g = info.geometry;
  for (const double number : g.spacing) put(to, number);
  for (const double number : g.origin) put(to, number);
  for (const auto& direction : g.directions)
    for (const double number : direction) put(to, number);
  for (const int is_known : {g.has_spacing, g.has_origin, g.has_directions}) put(to, is_known);
  for (const double number : {info.max_error, info.surface_error, info.mesh_error, info.achieved_max_error,
                              info.achieved_rmse, info.achieved_psnr, info.low, info.high, info.mean})
    put(to, number);
  put(to, static_cast<double>(info.brick_edge));
  put(to, info.lead);
  put(to, tagrid_blocks_stores_grid(blocks));
  put(to, static_cast<double>(volumes));
  for (const std::int64_t factor : factors) put(to, static_cast<double>(factor));
  return status;
}

EXPORTED const void* web_header(const tagrid_blocks* blocks, std::size_t* bytes) {
  return tagrid_blocks_header(blocks, bytes);
}

EXPORTED int web_overview(tagrid_blocks* blocks, double factor, tagrid_blocks** result) {
  return tagrid_blocks_overview(blocks, static_cast<std::int64_t>(factor), result);
}

EXPORTED int web_volume(tagrid_blocks* blocks, double number, tagrid_blocks** result) {
  return tagrid_blocks_volume(blocks, static_cast<std::int64_t>(number), result);
}

// `numbers` has the six of a box, and then room for `room` times 12: number, low and high of the box,
// offset and bytes of the range, bytes of the activity, slices. Returns how many are filled, or minus the
// status.
EXPORTED int web_plan(tagrid_blocks* blocks, double first, double* numbers, std::size_t room) {
  tagrid_box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = static_cast<std::int64_t>(numbers[axis]);
    box.high[axis] = static_cast<std::int64_t>(numbers[3 + axis]);
  }
  constexpr std::size_t most = 64;
  tagrid_block found[most];
  std::size_t count = 0;
  const int status = tagrid_blocks_plan(blocks, &box, static_cast<std::int64_t>(first), found,
                                        room < most ? room : most, &count);
  if (status != TAGRID_OK) return -status;
  double* to = numbers + 6;
  for (std::size_t i = 0; i < count; ++i) {
    const tagrid_block& block = found[i];
    put(to, static_cast<double>(block.number));
    for (const std::int64_t place : block.box.low) put(to, static_cast<double>(place));
    for (const std::int64_t place : block.box.high) put(to, static_cast<double>(place));
    put(to, static_cast<double>(block.range.offset));
    put(to, static_cast<double>(block.range.bytes));
    put(to, static_cast<double>(block.activity_bytes));
    put(to, static_cast<double>(block.slices));
    put(to, 0);
  }
  static_assert(1 + 6 + 2 + 1 + 1 + 1 == numbers_of_block);
  return static_cast<int>(count);
}
