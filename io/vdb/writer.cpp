#include "io/vdb/writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "io/bytes/byte_fields.h"
#include "io/bytes/checksum.h"
#include "io/files/errors.h"
#include "io/files/output_file.h"
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

/// The voxel of the first sample: the same as in the grid from which the volume came, if it fits.
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

class GridSink : public VolumeSink {
 public:
  GridSink(const std::string& path, const VolumeInfo& info, const SinkOptions& options,
           const VdbOptions& grid)
      : VolumeSink(info),
        file_(path, options.overwrite, {.like = options.like, .others_write = options.others_write}),
        options_(grid),
        place_(vdb_place_of(info.nrrd_fields)),
        spool_(SpoolFile::beside(path)) {
    if (grid.background && !is_number_of(info.type, *grid.background))
      throw UsageError(Sentence{"{} {}: is not a value of type {}",
                                {background_setting, *grid.background, name_of(info.type)}});
    if (!grid.background && place_.background && is_number_of(info.type, *place_.background))
      options_.background = place_.background;
    summary_.grid = !grid.grid.empty() ? grid.grid : !place_.grid.empty() ? place_.grid : "density";
    summary_.tolerance = grid.tolerance;
    if (grid.max_error) summary_.max_error = *grid.max_error + grid.tolerance;
    place_.low = low_of(info.dims, place_.low);
    box_ = {place_.low, place_.low + info.dims - Index3{1, 1, 1}};
    next_z_ = box_.low.z;
  }

  const VdbSummary& summary() const { return summary_; }
  bool any_order() const override { return false; }
  Place place() const override { throw std::logic_error("the leaves of a grid have no place beforehand"); }
  void publish() override {
    assert(bytes_left() == 0);
    file_.publish();
  }
  void keep() override { file_.keep(); }
  std::uint64_t bytes_written() const override { return file_.position(); }

 protected:
  OutputFile file_;
  VdbOptions options_;
  VdbPlace place_;
  SpoolFile spool_;
  VdbSummary summary_;
  Box box_;
  std::int64_t next_z_ = 0;  ///< The first slice that has not been passed to a leaf.
};

/// T is the type of the grid.
template <class T>
class GridSinkOf final : public GridSink {
 public:
  using GridSink::GridSink;

 private:
  void write(std::int64_t, std::span<const std::byte> samples) override {
    with_sample_type(info().type, [&](auto sample) {
      using S = decltype(sample);
      if constexpr (std::is_same_v<GridType<S>, T>) {
        if (!voxels_ && !samples.empty()) begin(load_little(samples, S{}));
        for (; !samples.empty(); samples = samples.subspan(sizeof(S))) {
          layer_.push_back(static_cast<T>(load_little(samples, S{})));
          if (layer_.size() == layer_samples()) flush();
        }
      }
    });
    if (bytes_left() == 0) finish();
  }

  template <class S>
  static S load_little(std::span<const std::byte> samples, S sample) {
    std::copy_n(samples.begin(), sizeof(S), reinterpret_cast<std::byte*>(&sample));
    return sample;
  }

  void begin(auto first) {
    const auto value = static_cast<double>(first);
    summary_.background = options_.background.value_or(std::isfinite(value) ? value : 0);
    layer_.reserve(
        static_cast<std::size_t>(std::min(vdb::leaf_edge, info().dims.z) * info().dims.x * info().dims.y));
    voxels_.emplace(box_, static_cast<T>(summary_.background), options_.tolerance, spool_);
    summary_.background = static_cast<double>(voxels_->background());
  }

  std::int64_t layer_slices() const {
    return std::min((next_z_ & -vdb::leaf_edge) + vdb::leaf_edge, box_.high.z + 1) - next_z_;
  }
  std::size_t layer_samples() const {
    return static_cast<std::size_t>(layer_slices() * info().dims.x * info().dims.y);
  }

  void flush() {
    const std::int64_t count = layer_slices();
    voxels_->add(next_z_, count, layer_.data());
    next_z_ += count;
    layer_.clear();
  }

  void finish() {
    assert(next_z_ == box_.high.z + 1);
    std::vector<VdbSlot>& slots = voxels_->slots();
    sort_vdb_slots(slots);
    summary_.active_voxels = voxels_->active_count();
    const auto is_leaf = [](const VdbSlot& slot) { return slot.size != 0; };
    summary_.leaves = static_cast<std::uint64_t>(std::count_if(slots.begin(), slots.end(), is_leaf));

    std::uint64_t topology = 0, buffers = 0;
    for (const VdbSlot& slot : slots) buffers += slot.size;
    const T background = voxels_->background();
    write_vdb_topology<T>([&](std::span<const std::byte> bytes) { topology += bytes.size(); }, background,
                          slots, nullptr);
    const auto head = head_of_grid();
    file_.write(head_of_file(head, topology, buffers));
    file_.write(head);
    const VdbSink sink = [&](std::span<const std::byte> bytes) { file_.write(bytes); };
    BufferedSink buffered(sink);
    write_vdb_topology<T>(buffered.sink(), background, slots, &spool_);
    write_vdb_buffers(buffered.sink(), slots, spool_);
    buffered.flush();
  }

  /// Joins many small pieces into a few large ones.
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

  /// Everything before the head of the grid, with the positions of what follows.
  std::vector<std::byte> head_of_file(std::span<const std::byte> head, std::uint64_t topology,
                                      std::uint64_t buffers) const {
    FieldWriter out;
    out.put(vdb::magic_number);
    out.put(vdb::newest_version);
    out.put(library_major);
    out.put(library_minor);
    out.put(std::uint8_t{1});  // there are positions
    const std::uint64_t low = chained_checksum(checksum_of({head}), voxels_->checksum());
    const std::string uuid = uuid_of(voxels_->checksum(), low);
    out.put_bytes(std::as_bytes(std::span(uuid)));
    out.put(std::uint32_t{0});  // metadata of the file
    out.put(std::int32_t{1});   // grids
    put_vdb_text(out, summary_.grid);
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
    if (const auto& active = voxels_->active()) {
      metadata.add("file_bbox_max", active->high);
      metadata.add("file_bbox_min", active->low);
    }
    metadata.add("file_compression", std::string_view("blosc + active values"));
    metadata.add("file_voxel_count", static_cast<std::int64_t>(summary_.active_voxels));
    metadata.add("name", std::string_view(summary_.grid));
    metadata.add(vdb::dims_key, info().dims);
    if (summary_.max_error) metadata.add(vdb::error_key, *summary_.max_error);
    metadata.add(vdb::fields_key, std::string_view(info().nrrd_fields));
    metadata.add(vdb::type_key, name_of(info().type));
    metadata.put_to(out);
    put_vdb_transform(out, vdb_transform_of(info().geometry, box_.low));
    return std::move(out.bytes());
  }

  std::optional<VdbVoxels<T>> voxels_;
  std::vector<T> layer_;
};

}  // namespace

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

std::unique_ptr<VolumeSink> create_vdb(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options, const VdbOptions& grid) {
  return with_sample_type(info.type, [&](auto sample) -> std::unique_ptr<VolumeSink> {
    return std::make_unique<GridSinkOf<GridType<decltype(sample)>>>(path, info, options, grid);
  });
}

std::optional<VdbSummary> vdb_summary(const VolumeSink& sink) {
  const auto* grid = dynamic_cast<const GridSink*>(&sink);
  return grid != nullptr ? std::optional(grid->summary()) : std::nullopt;
}

}  // namespace tagrid
