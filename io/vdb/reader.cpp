#include "io/vdb/reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "io/files/errors.h"
#include "io/files/text.h"
#include "io/nrrd/geometry.h"
#include "io/vdb/format.h"
#include "io/vdb/header.h"
#include "io/vdb/slices.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {
namespace {

/// Returns true if `value` is a number of type To, and converts it.
template <class To, class From>
bool convert(From value, To& to) {
  if constexpr (std::is_integral_v<To>) {
    const auto number = static_cast<double>(value);
    if (!(number >= static_cast<double>(std::numeric_limits<To>::min()) &&
          number <= static_cast<double>(std::numeric_limits<To>::max())) ||
        number != std::floor(number))
      return false;
    to = static_cast<To>(number);
    return true;
  } else {
    to = static_cast<To>(value);
    return static_cast<double>(to) == static_cast<double>(value) || std::isnan(static_cast<double>(value));
  }
}

/// The box of the samples: the one that tagrid recorded, if no active voxel is outside it; otherwise the box
/// of the active voxels.
Box box_of(const VdbBytes& bytes, const VdbGridHead& head, const Index3& low,
           const std::optional<Box>& active) {
  std::optional<Box> box = active;
  if (head.dims) {
    const Box written = {low, low + *head.dims - Index3{1, 1, 1}};
    if (!written.empty() && (!active || written.contains(*active))) box = written;
  }
  if (!box) throw BrokenInput(bytes.name() + ": OpenVDB file: the grid has no active voxel");
  const Index3 dims = box->size();
  if (!is_volume_size(dims))
    throw BrokenInput(
        fmt::format("{}: OpenVDB file: its active voxels lie in a box of {} x {} x {}; at most 2^31 voxels "
                    "along an axis, and 2^58 in all, can be read",
                    bytes.name(), dims.x, dims.y, dims.z));
  return *box;
}

SampleType type_of(const VdbBytes& bytes, const VdbGridHead& head, SampleType stored) {
  const auto text = head.texts.find(vdb::type_key);
  if (text == head.texts.end()) return stored;
  const auto type = sample_type_named(text->second);
  if (!type)
    bytes.fail(fmt::format("{} is {}, which is not a sample type", vdb::type_key, quoted(text->second)));
  return *type;
}

/// The header lines that a volume had before tagrid wrote it as this grid, if they still match the position
/// of the grid.
std::optional<std::string> fields_before(const VdbGridHead& head, const Box& box) {
  const auto text = head.texts.find(vdb::fields_key);
  if (text == head.texts.end() || head.dims != box.size() || !head.transform) return std::nullopt;
  try {
    const Geometry geometry = geometry_of(text->second);
    if (vdb_place_of(text->second).low == box.low && vdb_transform_of(geometry, box.low) == *head.transform)
      return text->second;
  } catch (const BrokenInput&) {
    // Another program wrote the grid.
  }
  return std::nullopt;
}

Index3 low_before(const VdbGridHead& head) {
  const auto text = head.texts.find(vdb::fields_key);
  return text == head.texts.end() ? Index3{} : vdb_place_of(text->second).low;
}

/// The window into a file, and the file, which must not move.
struct OpenVdb {
  explicit OpenVdb(std::unique_ptr<FileBytes> the_file) : file(std::move(the_file)), bytes(*file) {}

  std::unique_ptr<FileBytes> file;
  VdbBytes bytes;
};

/// T is the type of the grid.
template <class T>
class VdbSource final : public VolumeSource {
 public:
  VdbSource(SourceFacts facts, std::unique_ptr<OpenVdb> open, VdbSlices<T> slices, std::int64_t low_z)
      : VolumeSource(std::move(facts)), open_(std::move(open)), slices_(std::move(slices)), low_z_(low_z) {}

  std::uint64_t bytes_read() const override { return open_->file->size().value(); }

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    for (std::int64_t z = first / slice_samples(); count > 0; ++z, count -= slice_samples()) {
      copy_slice(slices_.slice(low_z_ + z), z, out);
      out += slice_bytes();
    }
  }
  void seek(std::int64_t) override {}  // read() finds any slice
  void end() override {}

  void copy_slice(const std::vector<T>& slice, std::int64_t z, std::byte* out) const {
    if (info().type == sample_type_of<T>()) {
      std::memcpy(out, slice.data(), slice.size() * sizeof(T));
      return;
    }
    with_sample_type(info().type, [&](auto type) {
      using To = decltype(type);
      for (std::size_t i = 0; i < slice.size(); ++i) {
        To value;
        if (!convert(slice[i], value))
          throw BrokenInput(
              fmt::format("{}: OpenVDB file: {} says {}, but {} in slice {} is not a value of that type; "
                          "remove this metadata entry, because it is no longer true",
                          name(), vdb::type_key, name_of(info().type), slice[i], z));
        std::memcpy(out + i * sizeof(To), &value, sizeof(To));
      }
    });
  }

  std::unique_ptr<OpenVdb> open_;
  VdbSlices<T> slices_;
  std::int64_t low_z_;
};

template <class T>
std::unique_ptr<VolumeSource> open_tree(std::unique_ptr<OpenVdb> open, const std::string& path,
                                        const VdbGrid& grid, const VdbGridHead& head,
                                        const VdbPacking& packing) {
  VdbTree<T> tree = read_vdb_tree<T>(open->bytes, packing);
  const Box box = box_of(open->bytes, head, low_before(head), tree.active);
  VolumeInfo info;
  info.dims = box.size();
  info.type = type_of(open->bytes, head, sample_type_of<T>());
  const auto fields = fields_before(head, box);
  std::optional<double> background = static_cast<double>(tree.background);
  if (!std::isfinite(*background)) background.reset();
  info.nrrd_fields = fields ? *fields : nrrd_fields_of(head.transform, {box.low, grid.name, background});
  info.geometry = geometry_of(info.nrrd_fields);
  VdbSlices<T> slices(open->bytes, packing, std::move(tree), box);
  const auto slice = static_cast<std::uint64_t>(info.dims.x * info.dims.y) * size_of(info.type);
  // An OpenVDB file holds more than these samples: the active state of voxels, for example.
  return std::make_unique<VdbSource<T>>(
      SourceFacts{std::move(info), {path}, {true, false, true, slices.memory() + slice}, true, false},
      std::move(open), std::move(slices), box.low.z);
}

}  // namespace

bool begins_vdb(std::string_view bytes) { return bytes.starts_with(vdb::magic); }

std::unique_ptr<VolumeSource> open_vdb(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source) {
  if (source.raw) throw UsageError(file->name() + ": is an OpenVDB file", Problem::describes_itself);
  if (!file->size())
    throw UsageError(file->name() + ": an OpenVDB file cannot be read from a pipe; give the file");
  auto open = std::make_unique<OpenVdb>(std::move(file));
  VdbBytes& bytes = open->bytes;
  const std::vector<VdbGrid> grids = read_vdb_grids(bytes);
  const VdbGrid& grid = choose_vdb_grid(grids, source.vdb_grid, bytes.name());
  const VdbGridHead head = read_vdb_grid_head(bytes, grid);
  VdbPacking packing = head.packing;
  if (!grid.parent.empty()) {
    const auto parent = std::find_if(grids.begin(), grids.end(),
                                     [&](const VdbGrid& other) { return other.name == grid.parent; });
    if (parent == grids.end() || !parent->parent.empty() || parent->type != grid.type)
      bytes.fail("a grid shares the tree of a grid that does not exist");
    packing = read_vdb_grid_head(bytes, *parent).packing;
  }
  if (grid.type == vdb::grid_type<float>())
    return open_tree<float>(std::move(open), path, grid, head, packing);
  if (grid.type == vdb::grid_type<double>())
    return open_tree<double>(std::move(open), path, grid, head, packing);
  if (grid.type == vdb::grid_type<std::int32_t>())
    return open_tree<std::int32_t>(std::move(open), path, grid, head, packing);
  throw BrokenInput(
      fmt::format("{}: only grids of floats, doubles and 32-bit integers can be read, and {} is not one of "
                  "them; the file has {}",
                  bytes.name(), quoted(grid.name), list_of(grids)));
}

}  // namespace tagrid
