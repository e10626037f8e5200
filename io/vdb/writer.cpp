#include "io/vdb/writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "io/bytes/byte_fields.h"
#include "io/bytes/checksum.h"
#include "io/files/errors.h"
#include "io/nrrd/line.h"
#include "io/vdb/format.h"
#include "io/vdb/metadata.h"
#include "io/vdb/transform.h"
#include "io/vdb/tree_writer.h"
#include "io/vdb/values.h"
#include "io/vdb/voxels.h"

namespace tagrid {
namespace {

constexpr Setting background_setting = {"vdb-background", "the background"};

constexpr std::uint32_t library_major = 10, library_minor = 0;  // the files have the layout of this version

/// The type of the grid for samples of type S.
template <class S>
using GridType = std::conditional_t<
    std::is_same_v<S, float>, float,
    std::conditional_t<std::is_same_v<S, double> || std::is_same_v<S, std::uint32_t>, double, std::int32_t>>;

bool is_number_of(SampleType type, double number) {
  return with_sample_type(type, [&](auto sample) {
    using S = decltype(sample);
    if constexpr (std::is_floating_point_v<S>)
      return std::abs(number) <= static_cast<double>(std::numeric_limits<S>::max());
    else
      return number >= static_cast<double>(std::numeric_limits<S>::min()) &&
             number <= static_cast<double>(std::numeric_limits<S>::max()) && number == std::floor(number);
  });
}

/// The voxel of the first sample: as in the grid from which the volume came, if there is room.
Index3 low_of(const Index3& dims, const Index3& wanted) {
  for (int axis = 0; axis < 3; ++axis)
    if (wanted[axis] + dims[axis] - 1 > std::numeric_limits<std::int32_t>::max()) return {};
  return wanted;
}

std::string uuid_of(std::uint64_t high, std::uint64_t low) {
  const std::string digits = fmt::format("{:016x}{:016x}", high, low);
  return fmt::format("{}-{}-{}-{}-{}", digits.substr(0, 8), digits.substr(8, 4), digits.substr(12, 4),
                     digits.substr(16, 4), digits.substr(20));
}

}  // namespace

struct VdbWriter::Grid {
  Grid(const std::string& path, const VolumeInfo& the_info, const VdbOptions& the_options)
      : info(the_info),
        options(the_options),
        place(vdb_place_of(info.nrrd_fields)),
        spool(SpoolFile::beside(path)) {
    if (options.background && !is_number_of(info.type, *options.background))
      throw UsageError(
          Sentence{"{} {}: is no {}", {background_setting, *options.background, name_of(info.type)}});
    if (!options.background && place.background && is_number_of(info.type, *place.background))
      options.background = place.background;
    summary.grid = !options.grid.empty() ? options.grid : !place.grid.empty() ? place.grid : "density";
    summary.tolerance = options.tolerance;
    if (options.max_error) summary.max_error = *options.max_error + options.tolerance;
    place.low = low_of(info.dims, place.low);
    box = {place.low, place.low + info.dims - Index3{1, 1, 1}};
    next_z = box.low.z;
  }
  virtual ~Grid() = default;
  virtual void write(std::span<const std::byte> samples) = 0;
  virtual void finish(OutputFile& file) = 0;

  VolumeInfo info;
  VdbOptions options;
  VdbPlace place;
  SpoolFile spool;
  VdbSummary summary;
  Box box;
  std::int64_t next_z = 0;  ///< The first slice that has not gone to a leaf.
};

/// T is the type of the grid.
template <class T>
struct VdbWriter::GridOf final : Grid {
  using Grid::Grid;

  void write(std::span<const std::byte> samples) override {
    with_sample_type(info.type, [&](auto sample) {
      using S = decltype(sample);
      if constexpr (std::is_same_v<GridType<S>, T>) {
        if (!voxels && !samples.empty()) begin(load_little(samples, S{}));
        for (; !samples.empty(); samples = samples.subspan(sizeof(S))) {
          layer.push_back(static_cast<T>(load_little(samples, S{})));
          if (layer.size() == layer_samples()) flush();
        }
      }
    });
  }

  template <class S>
  static S load_little(std::span<const std::byte> samples, S sample) {
    std::copy_n(samples.begin(), sizeof(S), reinterpret_cast<std::byte*>(&sample));
    return sample;
  }

  void begin(auto first) {
    const auto value = static_cast<double>(first);
    summary.background = options.background.value_or(std::isfinite(value) ? value : 0);
    layer.reserve(
        static_cast<std::size_t>(std::min(vdb::leaf_edge, info.dims.z) * info.dims.x * info.dims.y));
    voxels.emplace(box, static_cast<T>(summary.background), options.tolerance, spool);
    summary.background = static_cast<double>(voxels->background());
  }

  std::int64_t layer_slices() const {
    return std::min((next_z & -vdb::leaf_edge) + vdb::leaf_edge, box.high.z + 1) - next_z;
  }
  std::size_t layer_samples() const {
    return static_cast<std::size_t>(layer_slices() * info.dims.x * info.dims.y);
  }

  void flush() {
    const std::int64_t count = layer_slices();
    voxels->add(next_z, count, layer.data());
    next_z += count;
    layer.clear();
  }

  void finish(OutputFile& file) override {
    assert(next_z == box.high.z + 1);
    std::vector<VdbSlot>& slots = voxels->slots();
    sort_vdb_slots(slots);
    summary.active_voxels = voxels->active_count();
    const auto is_leaf = [](const VdbSlot& slot) { return slot.size != 0; };
    summary.leaves = static_cast<std::uint64_t>(std::count_if(slots.begin(), slots.end(), is_leaf));

    std::uint64_t topology = 0, buffers = 0;
    for (const VdbSlot& slot : slots) buffers += slot.size;
    const T background = voxels->background();
    write_vdb_topology<T>([&](std::span<const std::byte> bytes) { topology += bytes.size(); }, background,
                          slots, nullptr);
    const auto head = head_of_grid();
    file.write(head_of_file(head, topology, buffers));
    file.write(head);
    const VdbSink sink = [&](std::span<const std::byte> bytes) { file.write(bytes); };
    BufferedSink buffered(sink);
    write_vdb_topology<T>(buffered.sink(), background, slots, &spool);
    write_vdb_buffers(buffered.sink(), slots, spool);
    buffered.flush();
  }

  /// Joins many small pieces to a few large ones.
  class BufferedSink {
   public:
    explicit BufferedSink(const VdbSink& to) : to_(to) {}
    VdbSink sink() {
      return [this](std::span<const std::byte> bytes) {
        buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
        if (buffer_.size() >= std::size_t{1} << 20) flush();
      };
    }
    void flush() {
      to_(buffer_);
      buffer_.clear();
    }

   private:
    const VdbSink& to_;
    std::vector<std::byte> buffer_;
  };

  /// Everything up to the grid's own head, with the positions of what follows.
  std::vector<std::byte> head_of_file(std::span<const std::byte> head, std::uint64_t topology,
                                      std::uint64_t buffers) const {
    FieldWriter out;
    out.put(vdb::magic_number);
    out.put(vdb::newest_version);
    out.put(library_major);
    out.put(library_minor);
    out.put(std::uint8_t{1});  // there are positions
    const std::uint64_t low = chained_checksum(checksum_of({head}), voxels->checksum());
    const std::string uuid = uuid_of(voxels->checksum(), low);
    out.put_bytes(std::as_bytes(std::span(uuid)));
    out.put(std::uint32_t{0});  // metadata of the file
    out.put(std::int32_t{1});   // grids
    put_vdb_text(out, summary.grid);
    put_vdb_text(out, vdb::grid_type<T>());
    put_vdb_text(out, "");  // it shares no tree
    const std::uint64_t begin = out.bytes().size() + 3 * sizeof(std::uint64_t);
    out.put(begin);
    out.put(begin + head.size() + topology);
    out.put(begin + head.size() + topology + buffers);
    return std::move(out.bytes());
  }

  std::vector<std::byte> head_of_grid() const {
    FieldWriter out;
    out.put(vdb_packing_written);
    VdbMetadata metadata;
    if (const auto& active = voxels->active()) {
      metadata.add("file_bbox_max", active->high);
      metadata.add("file_bbox_min", active->low);
    }
    metadata.add("file_compression", std::string_view("blosc + active values"));
    metadata.add("file_voxel_count", static_cast<std::int64_t>(summary.active_voxels));
    metadata.add("name", std::string_view(summary.grid));
    metadata.add(vdb::dims_key, info.dims);
    if (summary.max_error) metadata.add(vdb::error_key, *summary.max_error);
    metadata.add(vdb::fields_key, std::string_view(info.nrrd_fields));
    metadata.add(vdb::type_key, name_of(info.type));
    metadata.put_to(out);
    put_vdb_transform(out, vdb_transform_of(info.geometry, box.low));
    return std::move(out.bytes());
  }

  std::optional<VdbVoxels<T>> voxels;
  std::vector<T> layer;
};

std::uint64_t memory_of_vdb_writer(const VolumeInfo& info) {
  const auto leaves = [](std::int64_t samples) { return static_cast<double>(samples / vdb::leaf_edge + 2); };
  const double samples_of_layer =
                   static_cast<double>(vdb::leaf_edge * info.dims.x) * static_cast<double>(info.dims.y),
               slots = leaves(info.dims.x) * leaves(info.dims.y) * leaves(info.dims.z);
  const std::size_t size = with_sample_type(info.type, [](auto s) { return sizeof(GridType<decltype(s)>); });
  // The list of slots grows: allow 3 times its content.
  const double bytes = samples_of_layer * static_cast<double>(size) + 3 * slots * sizeof(VdbSlot);
  return static_cast<std::uint64_t>(std::min(bytes, 4e18));
}

VdbWriter::VdbWriter(const std::string& path, const VolumeInfo& info, const VdbOptions& options) {
  with_sample_type(info.type, [&](auto sample) {
    grid_ = std::make_unique<GridOf<GridType<decltype(sample)>>>(path, info, options);
  });
}

VdbWriter::VdbWriter(VdbWriter&&) noexcept = default;
VdbWriter& VdbWriter::operator=(VdbWriter&&) noexcept = default;
VdbWriter::~VdbWriter() = default;

void VdbWriter::write(std::span<const std::byte> samples) { grid_->write(samples); }
void VdbWriter::finish(OutputFile& file) { grid_->finish(file); }
const VdbSummary& VdbWriter::summary() const { return grid_->summary; }

}  // namespace tagrid
