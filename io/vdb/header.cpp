#include "io/vdb/header.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/files/errors.h"
#include "io/files/text.h"
#include "io/nrrd/header.h"
#include "io/vdb/format.h"

namespace tagrid {
namespace {

constexpr Setting vdb_grid_setting = {"vdb-grid", "the grid"};

/// Reads the metadata of a file or a grid; values that tagrid wrote go to `head`.
void read_metadata(VdbBytes& bytes, VdbGridHead* head) {
  const auto count = bytes.number<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string name = bytes.text(vdb::longest_name);
    const std::string type = bytes.text(vdb::longest_name);
    const bool ours = head != nullptr && name.starts_with("tagrid_");
    if (ours && type == "string") {
      head->texts[name] = bytes.text(max_nrrd_header_bytes);
      continue;
    }
    const auto size = bytes.number<std::uint32_t>();
    if (ours && name == vdb::dims_key && type == "vec3i" && size == 12) {
      head->dims.emplace();
      for (int axis = 0; axis < 3; ++axis) (*head->dims)[axis] = bytes.number<std::int32_t>();
      continue;
    }
    bytes.skip(size);
  }
}

/// "density\x1e1" is the second of several grids named density.
std::string readable(const std::string& unique_name) {
  const std::size_t separator = unique_name.find(vdb::name_separator);
  if (separator == unique_name.npos) return unique_name;
  return unique_name.substr(0, separator) + "[" + unique_name.substr(separator + 1) + "]";
}

VdbGrid read_grid_name(VdbBytes& bytes) {
  VdbGrid grid;
  grid.name = readable(bytes.text(vdb::longest_name));
  grid.type = bytes.text(vdb::longest_name);
  grid.half = grid.type.ends_with(vdb::half_suffix);
  if (grid.half) grid.type.resize(grid.type.size() - vdb::half_suffix.size());
  grid.parent = readable(bytes.text(vdb::longest_name));
  return grid;
}

std::string_view plain_name(std::string_view name) {
  const std::size_t bracket = name.rfind('[');
  return bracket != name.npos && name.ends_with(']') ? name.substr(0, bracket) : name;
}

}  // namespace

std::vector<VdbGrid> read_vdb_grids(VdbBytes& bytes) {
  bytes.skip(vdb::magic.size());
  const auto version = bytes.number<std::uint32_t>();
  if (version < vdb::oldest_version || version > vdb::newest_version)
    bytes.fail(fmt::format("its version is {}; versions {} to {} can be read", version, vdb::oldest_version,
                           vdb::newest_version));
  bytes.skip(8);  // the version of the library
  const bool has_positions = bytes.number<std::uint8_t>() != 0;
  bytes.skip(vdb::uuid_bytes);
  read_metadata(bytes, nullptr);
  const auto count = bytes.number<std::int32_t>();
  if (count > 1 && !has_positions)
    bytes.fail(
        "it was written to a stream, so it does not say where its grids are; write it to a file instead");
  std::vector<VdbGrid> grids;
  for (std::int32_t i = 0; i < count; ++i) {
    VdbGrid grid = read_grid_name(bytes);
    const auto begin = bytes.number<std::uint64_t>();
    bytes.skip(8);  // the position of its buffers: they follow its tree
    const auto end = bytes.number<std::uint64_t>();
    grid.position = bytes.position();
    if (has_positions && (begin != grid.position || end <= begin))
      bytes.fail("the position of a grid is impossible");
    if (has_positions) bytes.seek(end);
    grids.push_back(std::move(grid));
  }
  return grids;
}

std::string list_of(const std::vector<VdbGrid>& grids) {
  std::string list;
  for (const VdbGrid& grid : grids)
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", quoted(grid.name),
                        grid.type.substr(0, 40) + (grid.half ? " as halves" : ""));
  return list;
}

const VdbGrid& choose_vdb_grid(const std::vector<VdbGrid>& grids, const std::string& name,
                               const std::string& file) {
  if (grids.empty()) throw BrokenInput(file + ": this OpenVDB file has no grid");
  if (name.empty() && grids.size() == 1) return grids[0];
  if (name.empty())
    throw UsageError(fmt::format("{}: has several grids: {}", file, list_of(grids)), Problem::several_grids);
  const auto exactly = [&](const VdbGrid& grid) { return grid.name == name; };
  const auto nearly = [&](const VdbGrid& grid) { return plain_name(grid.name) == name; };
  if (const auto found = std::find_if(grids.begin(), grids.end(), exactly); found != grids.end())
    return *found;
  if (std::count_if(grids.begin(), grids.end(), nearly) == 1)
    return *std::find_if(grids.begin(), grids.end(), nearly);
  throw UsageError(Sentence{"{}: {} {}: there is no such grid; the file has {}",
                            {file, vdb_grid_setting, name, list_of(grids)}});
}

VdbGridHead read_vdb_grid_head(VdbBytes& bytes, const VdbGrid& grid) {
  bytes.seek(grid.position);
  VdbGridHead head;
  const auto packing = bytes.number<std::uint32_t>();
  if ((packing & ~(vdb::compress_zip | vdb::compress_active | vdb::compress_blosc)) != 0)
    bytes.fail(fmt::format("values are compressed in an unknown way, {}", packing));
  head.packing = {(packing & vdb::compress_zip) != 0, (packing & vdb::compress_blosc) != 0,
                  (packing & vdb::compress_active) != 0, grid.half};
  read_metadata(bytes, &head);
  head.transform = read_vdb_transform(bytes);
  return head;
}

}  // namespace tagrid
