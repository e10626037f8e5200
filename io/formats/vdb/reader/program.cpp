// tagrid-read-vdb: reads grids of OpenVDB files (https://www.openvdb.org).

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/vdb/openvdb_library.h"
#include "io/formats/vdb/placement.h"
#include "io/formats/vdb/reader/grid_file.h"
#include "io/metadata/text.h"
#include "io/programs/serve_reader.h"
#include "io/programs/words.h"
#include "io/text/text.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

using openvdb::io::GridDescriptor;

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

/// What tagrid recorded when it wrote the grid.
struct Recorded {
  std::optional<SampleType> type;
  std::optional<Index3> dims;
  std::optional<Metadata> metadata;
};

std::optional<std::string> text_meta(const openvdb::MetaMap& meta, const char* key) {
  const auto value = meta.getMetadata<openvdb::StringMetadata>(key);
  return value ? std::optional(value->value()) : std::nullopt;
}

Recorded recorded_in(const openvdb::MetaMap& meta, const std::string& path) {
  Recorded recorded;
  try {
    if (const auto fields = text_meta(meta, vdb_fields_key)) recorded.metadata = parse_metadata(*fields);
  } catch (const BrokenInput&) {
    // Another program wrote them.
  }
  if (const auto dims = meta.getMetadata<openvdb::Vec3IMetadata>(vdb_dims_key))
    recorded.dims = Index3{dims->value().x(), dims->value().y(), dims->value().z()};
  if (const auto type = text_meta(meta, vdb_type_key)) {
    recorded.type = sample_type_named(*type);
    if (!recorded.type)
      throw_broken_vdb(path, fmt::format("{} is {}, which is not a sample type", vdb_type_key,
                                         tagrid::quoted(std::string_view(*type))));
  }
  return recorded;
}

/// What else the grid says, such as who made it. The library's own entries follow from the samples, or are kept
/// in other ways.
KeyValues other_metadata(const openvdb::GridBase& grid) {
  using openvdb::GridBase;
  static const std::array known = {GridBase::META_GRID_CLASS, GridBase::META_GRID_NAME,
                                   GridBase::META_SAVE_HALF_FLOAT, GridBase::META_IS_LOCAL_SPACE};
  KeyValues pairs;
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry)
    if (const std::string& name = entry->first; !name.starts_with("tagrid_") && !name.starts_with("file_") &&
                                                std::ranges::find(known, name) == known.end())
      pairs.emplace_back("openvdb_" + name, entry->second->str());
  return pairs;
}

/// The box of the samples: the one that tagrid recorded, if no active voxel is outside it; otherwise the box
/// of the active voxels.
Box box_of(const std::string& path, const Recorded& recorded, const std::optional<Box>& active) {
  std::optional<Box> box = active;
  if (recorded.dims) {
    const Index3 low = vdb_place_of(recorded.metadata.value_or(Metadata())).low;
    const Box written = {low, low + *recorded.dims - Index3{1, 1, 1}};
    if (!written.empty() && (!active || written.contains(*active))) box = written;
  }
  if (!box) throw_broken_vdb(path, "the grid has no active voxel");
  const Index3 dims = box->size();
  if (!is_volume_size(dims))
    throw_broken_vdb(path, fmt::format("its active voxels lie in a box of {} x {} x {}; at most 2^31 voxels "
                                       "along an axis, and 2^58 in all, can be read",
                                       dims.x, dims.y, dims.z));
  return *box;
}

/// The metadata that a volume had before tagrid wrote it as this grid, if it still matches the position of the
/// grid.
std::optional<Metadata> metadata_before(const Recorded& recorded, const Box& box,
                                        const std::optional<openvdb::Mat4d>& matrix) {
  if (!recorded.metadata || recorded.dims != box.size() || !matrix) return std::nullopt;
  try {
    // What the writer made of it, which is rounded.
    if (vdb_place_of(*recorded.metadata).low == box.low &&
        matrix_of(*transform_of(recorded.metadata->geometry(), box.low)) == *matrix)
      return recorded.metadata;
  } catch (const openvdb::Exception&) {
    // Another program wrote the grid.
  }
  return std::nullopt;
}

template <class G>
class VdbVolume final : public ServedVolume {
 public:
  using Sample = typename GridSlices<G>::Sample;

  VdbVolume(const std::string& path, const GridDescriptor& descriptor, const GridLook& look)
      : path_(path), name_(GridDescriptor::nameAsString(descriptor.uniqueName())) {
    const auto& grid = static_cast<const G&>(*look.grid);
    const Recorded recorded = recorded_in(grid, path);
    box_ = box_of(path, recorded, look.active);
    dims = box_.size();
    type = recorded.type.value_or(sample_type_of<Sample>());
    files = {path};
    memory = look.memory + GridSlices<G>::memory(box_);
    const auto matrix = matrix_of(grid.transform());
    if (matrix) require_good(*matrix);
    metadata = metadata_before(recorded, box_, matrix);
    if (metadata) return;
    if (matrix) {
      geometry = geometry_of(*matrix, box_.low);
    } else {
      warnings = {path + ": OpenVDB file: its transform is a perspective, so the volume has no spacing"};
    }
    const bool has_class = grid.getGridClass() != openvdb::GRID_UNKNOWN;
    pairs = pairs_of(
        VdbPlace{box_.low, descriptor.gridName(), has_class ? G::gridClassToString(grid.getGridClass()) : "",
                 std::isfinite(look.background) ? std::optional(look.background) : std::nullopt});
    for (auto& pair : other_metadata(grid)) pairs.push_back(std::move(pair));
    if (recorded.metadata && !recorded.metadata->empty()) keep_pairs(*recorded.metadata);
  }

  void read_slice(std::int64_t z, std::byte* out) override try {
    if (!slices_) slices_.emplace(path_, name_, box_);
    const Sample* slice = slices_->slice(box_.low.z + z);
    with_sample_type(type, [&](auto sample) {
      using To = decltype(sample);
      for (std::int64_t i = 0; i < dims.x * dims.y; ++i) {
        To value;
        if constexpr (std::is_same_v<To, Sample>)
          value = slice[i];
        else if (!convert(slice[i], value))
          throw_broken_vdb(path_, fmt::format("{} says {}, but {} in slice {} is not a value of that type; "
                                              "remove this metadata entry, because it is no longer true",
                                              vdb_type_key, name_of(type), slice[i], z));
        store_little_endian(out + i * static_cast<std::int64_t>(sizeof(To)), value);
      }
    });
  } catch (const openvdb::Exception& error) {
    throw_broken_vdb(path_, error.what());
  }

 private:
  /// Of a grid that tagrid wrote, and that has another place since.
  void keep_pairs(const Metadata& before) {
    for (auto& pair : other_pairs_of(before)) pairs.push_back(std::move(pair));
    warnings.push_back(
        path_ +
        ": OpenVDB file: the grid is not where it was when tagrid wrote it; what tagrid recorded "
        "about its unit and its coordinate system is left out");
  }

  void require_good(const openvdb::Mat4d& matrix) const {
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 3; ++column)
        if (!std::isfinite(matrix[row][column]))
          throw_broken_vdb(path_, "its transform has numbers that are not finite");
    if (matrix.getMat3().det() == 0) throw_broken_vdb(path_, "the matrix of its transform is singular");
  }

  std::string path_, name_;
  Box box_;
  std::optional<GridSlices<G>> slices_;
};

/// Names are unique: those that several grids have get a number, and what is no name by which a grid could be
/// chosen becomes "#2".
std::vector<Choice> choices_of(const std::vector<GridDescriptor>& grids) {
  std::vector<Choice> choices;
  for (const GridDescriptor& grid : grids) {
    const bool is_unique = std::ranges::count(grids, grid.gridName(), &GridDescriptor::gridName) == 1;
    std::string name = is_unique ? grid.gridName() : GridDescriptor::nameAsString(grid.uniqueName());
    if (name.empty() || std::ranges::count(choices, name, &Choice::name) > 0)
      name = fmt::format("#{}", choices.size() + 1);
    choices.push_back({std::move(name), grid.gridType() + (grid.saveFloatAsHalf() ? " as halves" : "")});
  }
  return choices;
}

/// Opens the grid if it has type G or one of the others.
template <class G, class... Others>
std::unique_ptr<ServedVolume> open_grid(const std::string& path, GridFile& file, const GridDescriptor& grid) {
  if (grid.gridType() == G::gridType())
    return std::make_unique<VdbVolume<G>>(path, grid, file.look_at(grid, kind_of_grid<G>));
  if constexpr (sizeof...(Others) > 0)
    return open_grid<Others...>(path, file, grid);
  else
    throw BrokenInput(
        "{}: only grids of floats, doubles, 32-bit integers and bits can be read, and {} is not "
        "one of them, but {}",
        path, tagrid::quoted(std::string_view(grid.gridName())), grid.gridType());
}

/// Opens a grid of floats, halves, doubles, 32-bit integers, or bits: the one that the option "grid" names,
/// otherwise the only one. The volume is the box of the active voxels or, if tagrid wrote the file, the
/// original volume. An inactive voxel has the value that the tree has there. The type is that of the grid, or
/// the original type that tagrid recorded when it wrote the grid; a value that does not fit this type is
/// BrokenInput.
std::unique_ptr<ServedVolume> open_vdb(const std::string& path, const ReaderOptions& options) try {
  GridFile file(path);
  const std::size_t number = chosen(path, "grid", option(options, "grid"), choices_of(file.grids()));
  return open_grid<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::BoolGrid,
                   openvdb::MaskGrid>(path, file, file.grids()[number]);
} catch (const openvdb::Exception& error) {
  throw_broken_vdb(path, error.what());
}

}  // namespace
}  // namespace tagrid

int main() {
  const tagrid::OpenVdbLibrary library;
  return tagrid::serve_volumes("vdb", tagrid::open_vdb);
}
