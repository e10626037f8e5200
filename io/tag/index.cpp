#include "io/tag/index.h"

#include <algorithm>
#include <string>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"

namespace tagrid {
namespace {

constexpr std::uint64_t section_head = 4 + 8, page_facts = 4 + 4 + 3 * 8;

std::uint64_t volume_fields_size(const IndexForm& form) {
  return static_cast<std::uint64_t>(form.levels) * 8 + 9 * 8 + (form.mesh ? 8 : 0) + form.thresholds * 2 * 8;
}

/// The fields of the volume, for a FieldWriter or a FieldReader. `zero` follows the squared errors of floats.
void volume_fields(auto& fields, auto& index, const IndexForm& form, auto& zero) {
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
  fields.field(index.activity_bytes);
  fields.field(index.value_bytes);
  for (auto* counts : {&total.at_least, &total.moved})
    for (std::size_t i = 0; i < form.thresholds; ++i) fields.field(counts->all[i]);
}

// Stored by columns, which compress better.
void page_columns(auto& fields, auto& pages) {
  for (auto& page : pages) fields.field(page.sizes_bytes);
  for (auto& page : pages) fields.field(page.statistics_bytes);
  for (auto& page : pages) fields.field(page.brick_bytes);
  for (auto& page : pages) fields.field(page.low);
  for (auto& page : pages) fields.field(page.high);
}
void sizes_columns(auto& fields, auto& bricks) {
  for (auto& brick : bricks) fields.field(brick.activity_bytes);
  for (auto& brick : bricks) fields.field(brick.value_bytes);
}
void statistics_columns(auto& fields, auto& bricks) {
  for (auto& brick : bricks) fields.field(brick.low);
  for (auto& brick : bricks) fields.field(brick.high);
  for (auto& brick : bricks) fields.field(brick.mean);
}

void put_section(FieldWriter& fields, std::uint32_t kind, const std::vector<std::byte>& content) {
  fields.put(kind);
  fields.put(static_cast<std::uint64_t>(content.size()));
  fields.put_bytes(content);
}

}  // namespace

IndexForm index_form(const CodingParameters& parameters) {
  const int levels = parameters.counts_points() ? max_level(parameters.cube_size) + 1 : 0;
  return {levels, is_float_type(parameters.type), parameters.mesh_error >= 0, 1, parameters.thresholds.count};
}

std::uint64_t least_directory_size(std::int64_t pages, const IndexForm& form) {
  return section_head + volume_fields_size(form) + section_head +
         static_cast<std::uint64_t>(pages) * page_facts;
}

std::vector<std::byte> serialize_directory(const TagIndex& index, const IndexForm& form) {
  FieldWriter all, volume, pages;
  const std::uint64_t zero = 0;
  volume_fields(volume, index, form, zero);
  page_columns(pages, index.pages);
  put_section(all, volume_section, volume.bytes());
  put_section(all, pages_section, pages.bytes());
  if (!index.members.empty()) put_section(all, members_section, serialize_members(index.members));
  return std::move(all.bytes());
}

Status parse_directory(std::span<const std::byte> bytes, std::int64_t pages, const IndexForm& form,
                       TagIndex& index) {
  index = {};
  FieldReader reader(bytes);
  bool has_volume = false, has_pages = false;
  for (std::uint32_t before = 0; reader.left() > 0;) {
    const auto kind = reader.get<std::uint32_t>();
    const auto size = reader.get<std::uint64_t>();
    if (reader.overrun() || size > reader.left()) return Status::broken("a section of the index is cut off");
    if (kind <= before) return Status::broken("the sections of the index are not in order");
    before = kind;
    const std::span<const std::byte> section_bytes = reader.get_bytes(memory_size(size));
    FieldReader section(section_bytes);
    if (kind == volume_section) {
      if (size != volume_fields_size(form))
        return Status::broken("the section of the volume has an impossible size");
      std::uint64_t zero = 0;
      index.total.at_least.count = index.total.moved.count = form.thresholds;
      volume_fields(section, index, form, zero);
      if (zero != 0) return Status::broken("the index has bits that must be 0");
      has_volume = true;
    } else if (kind == pages_section) {
      if (size != static_cast<std::uint64_t>(pages) * page_facts)
        return Status::broken("the number of pages does not fit the number of bricks");
      index.pages.assign(memory_size(static_cast<std::uint64_t>(pages)), {});
      page_columns(section, index.pages);
      has_pages = true;
    } else if (kind == members_section) {
      if (Status status = parse_members(section_bytes, form.volumes, index.members); !status.ok())
        return status;
    } else if (kind < first_optional_section) {
      return Status::newer("the index has a section of kind " + std::to_string(kind) +
                           ", which this version of tagrid does not know");
    } else {
      index.unknown_sections.push_back(kind);
    }
  }
  if (!has_volume || !has_pages || (form.volumes > 1 && index.members.empty()))
    return Status::broken("a section of the index is missing");
  return {};
}

std::vector<std::byte> serialize_sizes(std::span<const IndexEntry> bricks) {
  FieldWriter fields;
  sizes_columns(fields, bricks);
  return std::move(fields.bytes());
}

std::vector<std::byte> serialize_statistics(std::span<const IndexEntry> bricks) {
  FieldWriter fields;
  statistics_columns(fields, bricks);
  return std::move(fields.bytes());
}

void parse_sizes(std::span<const std::byte> bytes, std::span<IndexEntry> bricks) {
  FieldReader fields(bytes);
  sizes_columns(fields, bricks);
}

void parse_statistics(std::span<const std::byte> bytes, std::span<IndexEntry> bricks) {
  FieldReader fields(bytes);
  statistics_columns(fields, bricks);
}

Status check_extremes(const TagIndex& index) {
  PageFacts range;
  for (const PageFacts& page : index.pages) {
    range.low = std::min(range.low, page.low);
    range.high = std::max(range.high, page.high);
  }
  return range.low == index.total.low && range.high == index.total.high
             ? Status()
             : Status::broken("the smallest or the largest sample is not that of the pages");
}

void take_range(std::span<const IndexEntry> bricks, PageFacts& page) {
  for (const IndexEntry& brick : bricks) {
    page.low = std::min(page.low, brick.low);
    page.high = std::max(page.high, brick.high);
  }
}

}  // namespace tagrid
