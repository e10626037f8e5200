#include "pipeline/serving/served_zarr.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <functional>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/table/formats.h"
#include "io/formats/zarr/metadata.h"
#include "io/server/site.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/reading/read_region.h"

namespace tagrid {
namespace {

/// The number that a text begins with, which is removed from it. Nothing if there is none. A number has one
/// form: no sign, and no needless zeros.
std::optional<std::int64_t> take_number(std::string_view& text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto length = static_cast<std::size_t>(end - text.data());
  if (error != std::errc() || number < 0 || text.front() == '-' || (text.front() == '0' && length > 1))
    return std::nullopt;
  text.remove_prefix(length);
  return number;
}

/// One of those who may decode at once.
class Turn {
 public:
  explicit Turn(std::counting_semaphore<>& turns) : turns_(turns) { turns_.acquire(); }
  ~Turn() { turns_.release(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  std::counting_semaphore<>& turns_;
};

bool take(std::string_view& text, std::string_view begin) {
  if (!text.starts_with(begin)) return false;
  text.remove_prefix(begin.size());
  return true;
}

}  // namespace

/// Decoded when it is read for the first time: its size is known before. For one thread.
class ServedChunk final : public ByteSource {
 public:
  ServedChunk(const ServedZarr& image, const ServedZarr::Level& level, const Index3& number)
      : image_(image), level_(level), number_(number) {}
  std::uint64_t size() const override { return sample_bytes(level_.chunk, image_.info_.type).value(); }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    if (bytes_.empty()) bytes_ = image_.decoded(level_, number_);
    std::memcpy(to.data(), bytes_.data() + position, to.size());
  }
  const std::string& name() const override { return level_.file->name(); }

 private:
  const ServedZarr& image_;
  const ServedZarr::Level& level_;
  Index3 number_;
  mutable std::vector<std::byte> bytes_;
};

ServedZarr::ServedZarr(std::shared_ptr<const TagBricks> file, const std::string& name, int decoders)
    : numbers_(written_numbers(format_named("zarr"), Numbers::automatic, file->header(), &file->index())),
      info_(numbers_.info(with_loss_of(volume_info_of(file->header()), file->parameters()))),
      facts_(known_facts(*file, numbers_)),
      decoders_(decoders) {
  const auto add = [&](std::shared_ptr<const TagBricks> of_level) {
    const CodingParameters& parameters = of_level->parameters();
    Index3 chunk;
    for (int axis = 0; axis < 3; ++axis)
      chunk[axis] = std::min(parameters.bricks().length(), parameters.dims[axis]);
    levels_.push_back(
        {std::move(of_level), chunk, zarr_array(parameters.dims, info_.type, {.chunk = chunk})});
  };
  add(file);
  facts_.levels.clear();
  for (const Member& member : file->index().members) {
    if (!member.is_overview()) continue;
    try {
      add(file->nested(member));
      facts_.levels.push_back({member.factor, levels_.back().file->parameters().dims});
    } catch (const BrokenInput& error) {
      left_out_.emplace_back(error.what());
    }
  }
  metadata_ = zarr_group(info_, facts_, name);
}

std::shared_ptr<const ByteSource> ServedZarr::file(std::string_view key) const {
  if (key == "zarr.json") return std::make_shared<BytesInMemory>(metadata_);
  const auto number = take_number(key);
  if (!number || *number >= static_cast<std::int64_t>(levels_.size())) return nullptr;
  const Level& level = levels_[static_cast<std::size_t>(*number)];
  if (key == "/zarr.json") return std::make_shared<BytesInMemory>(level.metadata);
  return take(key, "/c/") ? chunk_of(level, key) : nullptr;
}

std::shared_ptr<const ByteSource> ServedZarr::chunk_of(const Level& level, std::string_view place) const {
  const Index3& dims = level.file->parameters().dims;
  Index3 found;
  for (int axis = 2; axis >= 0; --axis) {
    if (axis < 2 && !take(place, "/")) return nullptr;
    const auto number = take_number(place);
    if (!number || *number > (dims[axis] - 1) / level.chunk[axis]) return nullptr;
    found[axis] = *number;
  }
  if (!place.empty()) return nullptr;
  return std::make_shared<ServedChunk>(*this, level, found);
}

std::vector<std::byte> ServedZarr::decoded(const Level& level, const Index3& chunk) const {
  const CodingParameters& parameters = level.file->parameters();
  Region region;
  for (int axis = 0; axis < 3; ++axis) {
    region.box.low[axis] = chunk[axis] * level.chunk[axis];
    region.box.high[axis] = std::min(region.box.low[axis] + level.chunk[axis], parameters.dims[axis]) - 1;
  }
  region.box = parameters.domain().points_of(region.box);
  const auto size = static_cast<std::int64_t>(size_of(info_.type));
  // Whoever waits holds no memory.
  const Turn turn(decoders_);
  // As other writers of Zarr do, what is beyond the volume is the fill value, 0.
  std::vector<std::byte> samples(memory_size(sample_bytes(level.chunk, info_.type).value()));
  read_region(*level.file, region,
              {samples.data(), {size, size * level.chunk.x, size * level.chunk.x * level.chunk.y}, numbers_},
              1);
  std::vector<std::byte> swapped;
  const auto ordered = little_endian_samples(samples, size_of(info_.type), swapped);
  return ordered.data() == samples.data() ? samples : swapped;
}

}  // namespace tagrid
