#include "io/formats/zarr/written.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/spool_file.h"
#include "io/formats/zarr/container.h"
#include "io/formats/zarr/crc32c.h"
#include "io/formats/zarr/metadata.h"
#include "io/metadata/lengths.h"

namespace tagrid {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t chunk = 64;            // samples along each axis
constexpr std::int64_t chunks_in_shard = 16;  // along x and y; along z, 1
constexpr std::int64_t shard = chunk * chunks_in_shard;

constexpr std::int64_t parts(std::int64_t samples, std::int64_t part) { return (samples - 1) / part + 1; }

/// One array. Layers of chunks are compressed as soon as they are complete.
class ZarrLevel final : public VolumeSink {
 public:
  ZarrLevel(const VolumeInfo& info, std::string path, ZarrContainer& container, SpoolFile& layer)
      : VolumeSink(info),
        path_(std::move(path)),
        container_(container),
        layer_(layer),
        size_(size_of(info.type)),
        context_(ZSTD_createCCtx(), ZSTD_freeCCtx) {
    if (!context_) throw std::bad_alloc();
    ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, zarr_zstd_level);
    ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_checksumFlag, 1);
  }

  bool is_complete() const { return bytes_left() == 0; }
  void publish() override {}
  void keep() override {}
  std::uint64_t bytes_written() const override { return 0; }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) override {
    std::vector<std::byte> swapped;
    samples = little_endian_samples(samples, size_, swapped);
    const std::uint64_t slice = static_cast<std::uint64_t>(info().dims.x * info().dims.y) * size_,
                        all = slice * static_cast<std::uint64_t>(info().dims.z);
    for (std::uint64_t at = static_cast<std::uint64_t>(first) * size_; !samples.empty();) {
      const std::uint64_t z = at / (slice * chunk), begin = z * slice * chunk,
                          end = std::min(begin + slice * chunk, all);
      const auto part =
          samples.first(static_cast<std::size_t>(std::min<std::uint64_t>(samples.size(), end - at)));
      layer_.write_at(at - begin, part);
      samples = samples.subspan(part.size());
      at += part.size();
      if (at == end) write_layer(static_cast<std::int64_t>(z));
    }
  }

  void write_layer(std::int64_t z) {
    for (std::int64_t y = 0; y < parts(info().dims.y, shard); ++y)
      for (std::int64_t x = 0; x < parts(info().dims.x, shard); ++x) write_shard(z, y, x);
    layer_.clear();
  }

  void write_shard(std::int64_t z, std::int64_t y, std::int64_t x) {
    constexpr std::uint64_t missing = std::numeric_limits<std::uint64_t>::max();
    std::array<std::uint64_t, 2 * chunks_in_shard * chunks_in_shard> index;
    index.fill(missing);
    container_.begin(fmt::format("{}/c/{}/{}/{}", path_, z, y, x));
    std::uint64_t position = 0;
    const std::int64_t width = std::min(shard, info().dims.x - x * shard);
    for (std::int64_t row = 0; row < chunks_in_shard; ++row) {
      const std::int64_t y0 = y * shard + row * chunk;
      if (y0 >= info().dims.y) break;
      read_band(z, y0, x * shard, width);
      for (std::int64_t column = 0; column < parts(width, chunk); ++column) {
        if (!take_chunk(column * chunk, width)) continue;
        const std::span<const std::byte> bytes = compressed();
        container_.write(bytes);
        const auto place = static_cast<std::size_t>(2 * (row * chunks_in_shard + column));
        index[place] = position;
        index[place + 1] = bytes.size();
        position += bytes.size();
      }
    }
    std::array<std::byte, index.size() * 8 + 4> bytes;
    for (std::size_t i = 0; i < index.size(); ++i) store_little_endian(&bytes[8 * i], index[i]);
    store_little_endian(&bytes[8 * index.size()], crc32c(std::span(bytes).first(8 * index.size())));
    container_.write(bytes);
    container_.end();
  }

  /// Reads the samples of a row of chunks from the layer: depth_ x height_ rows of `width` samples.
  void read_band(std::int64_t z, std::int64_t y0, std::int64_t x0, std::int64_t width) {
    const Index3& dims = info().dims;
    depth_ = std::min(chunk, dims.z - z * chunk);
    height_ = std::min(chunk, dims.y - y0);
    const std::size_t row = static_cast<std::size_t>(width) * size_;
    band_.resize(static_cast<std::size_t>(depth_ * height_) * row);
    const bool is_whole = width == dims.x;  // rows that follow one another are read at once
    for (std::int64_t dz = 0; dz < depth_; ++dz)
      for (std::int64_t dy = 0; dy < (is_whole ? 1 : height_); ++dy)
        layer_.read_at(static_cast<std::uint64_t>((dz * dims.y + y0 + dy) * dims.x + x0) * size_,
                       std::span(band_).subspan(static_cast<std::size_t>(dz * height_ + dy) * row,
                                                is_whole ? static_cast<std::size_t>(height_) * row : row));
  }

  /// Copies a chunk from the band. Beyond the volume, it has zeros. Returns false if it has nothing else.
  bool take_chunk(std::int64_t x0, std::int64_t width) {
    const std::int64_t count = std::min(chunk, width - x0);
    chunk_.assign(static_cast<std::size_t>(chunk * chunk * chunk) * size_, std::byte{0});
    for (std::int64_t z = 0; z < depth_; ++z)
      for (std::int64_t y = 0; y < height_; ++y)
        std::copy_n(&band_[static_cast<std::size_t>((z * height_ + y) * width + x0) * size_],
                    static_cast<std::size_t>(count) * size_,
                    &chunk_[static_cast<std::size_t>((z * chunk + y) * chunk) * size_]);
    return std::ranges::any_of(chunk_, [](std::byte byte) { return byte != std::byte{0}; });
  }

  std::span<const std::byte> compressed() {
    compressed_.resize(ZSTD_compressBound(chunk_.size()));
    const std::size_t size =
        ZSTD_compress2(context_.get(), compressed_.data(), compressed_.size(), chunk_.data(), chunk_.size());
    if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // the only reason, with enough room
    return std::span(compressed_).first(size);
  }

  std::string path_;
  ZarrContainer& container_;
  SpoolFile& layer_;
  std::size_t size_;
  std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context_;
  std::int64_t depth_ = 0, height_ = 0;
  std::vector<std::byte> band_, chunk_, compressed_;
};

class ZarrSink final : public VolumeSink {
 public:
  ZarrSink(const std::string& path, const VolumeInfo& info, const KnownFacts& facts,
           const SinkOptions& options)
      : VolumeSink(info),
        levels_of_means_(facts.levels),
        container_(create_zarr_container(path, options)),
        layer_(options.spool ? SpoolFile::in(*options.spool, path) : SpoolFile::beside(path)) {
    const std::string plain = path.substr(0, path.find_last_not_of('/') + 1);
    const std::string name = plain.substr(plain.rfind('/') + 1);
    container_->add("zarr.json", zarr_group(info, facts, name.substr(0, name.find('.', 1))));
    std::vector<VolumeInfo> levels = {info};
    for (const MeansLevel& level : facts.levels) {
      levels.push_back(info);
      levels.back().dims = level.dims;
    }
    for (const VolumeInfo& level : levels) {
      const std::string number = std::to_string(levels_.size());
      container_->add(number + "/zarr.json",
                      zarr_array(level.dims, level.type,
                                 {.chunk = {chunk, chunk, chunk}, .shard = Index3{shard, shard, chunk}}));
      levels_.push_back(std::make_unique<ZarrLevel>(level, number, *container_, layer_));
    }
  }

  VolumeSink& level(std::size_t number) override { return *levels_.at(number + 1); }
  std::string facts() const override {
    Json factors = Json::array({1});
    for (const MeansLevel& level : levels_of_means_) factors.push_back(level.factor);
    return Json{{"levels", std::move(factors)}}.dump();
  }
  void publish() override {
    assert(std::ranges::all_of(levels_, [](const auto& level) { return level->is_complete(); }));
    container_->publish();
  }
  void keep() override { container_->keep(); }
  std::uint64_t bytes_written() const override { return container_->bytes_written(); }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) override {
    levels_.front()->write_samples(first, samples);
  }

  std::vector<MeansLevel> levels_of_means_;
  std::unique_ptr<ZarrContainer> container_;
  SpoolFile layer_;
  std::vector<std::unique_ptr<ZarrLevel>> levels_;
};

}  // namespace

std::unique_ptr<VolumeSink> create_zarr(const std::string& path, const VolumeInfo& info,
                                        const KnownFacts& facts, const SinkOptions& options) {
  return std::make_unique<ZarrSink>(path, info, facts, options);
}

std::uint64_t memory_of_zarr(const VolumeInfo& info) {
  const std::uint64_t size = size_of(info.type), in_chunk = chunk * chunk * chunk * size,
                      band = chunk * chunk * static_cast<std::uint64_t>(std::min(shard, info.dims.x)) * size;
  // A context of zstd at this level takes less than 2 MiB.
  return band + in_chunk + ZSTD_compressBound(in_chunk) + (std::uint64_t{2} << 20);
}

std::string lost_rescale_in_zarr(const VolumeInfo& info) {
  return info.metadata.value("rescale_slope") ? "OME-Zarr has no place for slope and intercept" : "";
}

std::vector<std::string> lost_in_zarr(const VolumeInfo& info) {
  std::vector<std::string> lost;
  const Geometry& geometry = info.geometry();
  if (std::string mixed = lost_by_mixed_units(geometry); !mixed.empty()) lost.push_back(std::move(mixed));
  if (has_unknown_spacing(geometry))
    lost.emplace_back("OME-Zarr cannot record that a spacing is unknown; 1 is written");
  for (std::size_t axis = 0; axis < 3 && geometry.has_directions; ++axis)
    for (std::size_t row = 0; row < 3; ++row)
      if (row == axis ? geometry.directions[axis][row] < 0 : geometry.directions[axis][row] != 0) {
        lost.emplace_back("OME-Zarr 0.5 has no directions of axes; only tagrid reads them from such files");
        return lost;
      }
  return lost;
}

}  // namespace tagrid
