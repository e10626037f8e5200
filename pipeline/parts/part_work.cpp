#include "pipeline/parts/part_work.h"

#include <algorithm>
#include <cerrno>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/output_file.h"
#include "io/formats/table/open_volume.h"
#include "io/parts/part_folder.h"
#include "io/samples/file_samples.h"
#include "io/system/files.h"
#include "io/volume/volume_source.h"
#include "pipeline/encode/graph.h"
#include "pipeline/job/options.h"
#include "pipeline/slices/slices_ahead.h"

namespace tagrid {
namespace {

SumsLayout layout_of_parts(const CodingParameters& parameters) {
  return layout_of_sums(parameters.dims, parameters.type, block_edge);
}

// True if the part file exists and is intact. A damaged one is deleted.
bool is_complete(const PartsOfRun& parts, std::int64_t part) {
  const std::string path = parts.path(part);
  if (!status_of(path)) return false;
  try {
    PartReader reader(path, parts.id(part), parts.header().parameters);
    std::vector<std::byte> block;
    for (std::size_t i = 0; i < reader.table().size(); ++i) reader.read_block(block);
    reader.read_sums(std::size_t{1} << 20, {});
    return true;
  } catch (const BrokenInput&) {
    if (unlink(path.c_str()) != 0) throw world_error("cannot remove", path, errno);
    return false;
  }
}

std::int64_t sample_bytes_of(const CodingParameters& parameters, const BrickRows& rows) {
  return rows.owned(parameters.bricks()).count() * static_cast<std::int64_t>(size_of(parameters.type));
}

// The sums of the blocks of a part, in a temporary file until its bricks are written.
class SumsOfPart : public SumsSink {
 public:
  SumsOfPart(const std::string& part, const Box& blocks, const CodingParameters& parameters)
      : blocks_(blocks),
        row_bytes_(layout_of_parts(parameters).row_bytes()),
        file_(SpoolFile::beside(part)) {}

  void write(std::int64_t z, std::int64_t y, std::span<const std::byte> rows) override {
    file_.write_at(
        static_cast<std::uint64_t>((z - blocks_.low.z) * blocks_.size().y + y - blocks_.low.y) * row_bytes_,
        rows);
  }
  void write_to(PartWriter& writer) {
    std::vector<std::byte> bytes;
    for (std::uint64_t done = 0; done < file_.size(); done += bytes.size()) {
      bytes.resize(std::min<std::uint64_t>(file_.size() - done, 1 << 20));
      file_.read_at(done, bytes);
      writer.write_sums(bytes);
    }
  }

 private:
  Box blocks_;
  std::uint64_t row_bytes_;
  SpoolFile file_;
};

// The input, as opened by this rank.
class PartEncoder {
 public:
  PartEncoder(const Ranks& ranks, const PartOrder& order, const PartsOfRun& parts)
      : parts_(parts),
        parameters_(parts.header().parameters),
        volume_(open_volume(order.input, order.source)),
        job_{.header = parts.header(),
             .plan = plan_encoding(parameters_, of_this_rank(ranks, order.resources), true,
                                   {.besides = memory_besides_parts(*volume_), .sums = parts.has_sums()})},
        kept_(slices_kept_for_parts(*volume_, parts, job_.plan, of_this_rank(ranks, order.resources))) {
    if (volume_->info().dims != parameters_.dims || volume_->info().type != parameters_.type)
      throw WorldError(order.input + ": is not the volume that the run started with");
    if (!volume_->traits().any_rows) {
      // Without a spool, slices that are not kept are decoded again for each part.
      const std::optional<std::string>& spool = order.resources.spool;
      volume_ = spool ? spooled(std::move(volume_), *spool) : rows_of_slices(std::move(volume_), kept_);
    }
    slices_.emplace(*volume_, 0);
  }

  void encode(std::int64_t part, Watch& watch) {
    PartWriter writer(parts_.path(part), parts_.id(part), parameters_);
    std::optional<SumsOfPart> sums;
    if (parts_.has_sums()) sums.emplace(parts_.path(part), parts_.blocks(part), parameters_);
    tagrid::encode(job_, parts_.rows()[static_cast<std::size_t>(part)], *slices_, writer, watch,
                   sums ? &*sums : nullptr);
    if (sums) sums->write_to(writer);
    writer.finish();
  }

 private:
  const PartsOfRun& parts_;
  const CodingParameters& parameters_;
  std::unique_ptr<VolumeSource> volume_;
  EncodeJob job_;
  std::int64_t kept_;
  std::optional<SlicesAhead> slices_;
};

void place_part(PartReader& part, const std::vector<PartPlace>& places, PlacedFile& file) {
  constexpr std::size_t enough = std::size_t{1} << 23;
  std::vector<std::byte> block, bytes;
  auto entry = part.table().begin();
  for (const PartPlace& place : places) {
    std::uint64_t position = place.position, checksum = place.checksum_before;
    const auto flush = [&] {
      file.write_at(position, bytes);
      position += bytes.size();
      bytes.clear();
    };
    for (std::int64_t i = 0; i < place.bricks; ++i, ++entry) {
      part.read_block(block);
      checksum = chained_checksum(entry->own_checksum, checksum);
      store_little_endian(block.data() + block.size() - 8, checksum);
      bytes.insert(bytes.end(), block.begin(), block.end());
      if (bytes.size() >= enough) flush();
    }
    flush();
  }
}

}  // namespace

Resources of_this_rank(const Ranks& ranks, Resources given) {
  if (given.threads == 0) given.threads = available_threads();
  // A process that works alone may still be one of many on the machine.
  given.processes = std::max(given.processes, ranks.on_this_machine());
  return given;
}

std::uint64_t memory_besides_parts(const VolumeSource& source) {
  const SourceTraits& traits = source.traits();
  return 2 * traits.memory + (traits.any_rows ? 0 : source.slice_bytes());
}

std::int64_t slices_kept_for_parts(const VolumeSource& source, const PartsOfRun& parts,
                                   const EncodePlan& plan, const Resources& resources) {
  if (source.traits().any_rows || resources.spool) return 0;
  const CodingParameters& parameters = parts.header().parameters;
  std::int64_t longest = 0;
  for (const BrickRows& rows : parts.rows())
    for (const Box& box : samples_in_order(parameters, plan, rows)) longest = std::max(longest, box.size().z);
  return slices_beside(parameters, plan, resources, longest);
}

PartsOfRun::PartsOfRun(std::string folder, const Bytes& record) : folder_(std::move(folder)) {
  Status status = parse_record(record, record_);
  if (status.ok()) status = parse_header(record_.header, header_, header_checksum_);
  if (!status.ok()) throw BrokenInput(folder_ + ": the record of the run " + status.what());
  id_ = run_id(record);
  rows_ = parts_of(header_.parameters.bricks());
  has_sums_ = std::ranges::any_of(record_.settings, [](const auto& named) {
    return named.first == setting::overviews.name && named.second != text_of(std::vector<int>());
  });
}

Box PartsOfRun::blocks(std::int64_t part) const {
  return blocks_of_rows(header_.parameters, rows_[static_cast<std::size_t>(part)]);
}

std::string PartsOfRun::path(std::int64_t part) const { return PartFolder::part(folder_, part); }

PartId PartsOfRun::id(std::int64_t part) const {
  const BrickGrid bricks = header_.parameters.bricks();
  const BrickRows& rows = rows_[static_cast<std::size_t>(part)];
  const std::uint64_t sums = has_sums_
                                 ? static_cast<std::uint64_t>(blocks(part).size().y * blocks(part).size().z) *
                                       layout_of_parts(header_.parameters).row_bytes()
                                 : 0;
  return {id_, part, rows.first_brick(bricks), rows.count(bricks), sums};
}

SharedWork::Look look_for(const Progress& progress, const CodingParameters& parameters) {
  if (!progress) return {};
  const std::uint64_t total = sample_bytes(parameters.dims, parameters.type).value();
  return [=](const SharedNumbers& numbers) {
    progress(std::min(static_cast<std::uint64_t>(numbers.done), total), total);
  };
}

void make_parts(Ranks& ranks, const PartOrder& order, const Progress& progress) {
  std::unique_ptr<PartsOfRun> parts;
  std::unique_ptr<PartEncoder> encoder;
  all_do(ranks, [&] {
    parts = std::make_unique<PartsOfRun>(order.folder, order.record);
    if (!status_of(order.folder))
      throw WorldError(
          order.folder +
          ": does not exist on this machine; all ranks must see the directory of the output under "
          "the same name");
    encoder = std::make_unique<PartEncoder>(ranks, order, *parts);
  });
  SharedWork shared;
  SharedWatch watch(shared);
  shared.count = parts->count();
  const CodingParameters& parameters = parts->header().parameters;
  shared.work = [&](std::int64_t part) {
    if (!is_complete(*parts, part))
      encoder->encode(part, watch);
    else
      shared.add_done(sample_bytes_of(parameters, parts->rows()[static_cast<std::size_t>(part)]));
  };
  shared.look = look_for(progress, parameters);
  share_out(ranks, shared);
}

void place_parts(Ranks& ranks, const PlaceOrder& order) {
  std::unique_ptr<PartsOfRun> parts;
  std::unique_ptr<PlacedFile> file;
  all_do(ranks, [&] {
    parts = std::make_unique<PartsOfRun>(order.folder, order.record);
    file = std::make_unique<PlacedFile>(order.file, order.name);
  });
  SharedWork shared;
  shared.count = parts->count();
  shared.work = [&](std::int64_t part) {
    try {
      PartReader reader(parts->path(part), parts->id(part), parts->header().parameters);
      place_part(reader, order.places[static_cast<std::size_t>(part)], *file);
    } catch (const BrokenInput& broken) {
      throw WorldError(std::string(broken.what()) +
                       ": the bytes read are not those that were written; check the disk");
    }
  };
  share_out(ranks, shared);
  all_do(ranks, [&] { file->finish(); });
}

}  // namespace tagrid
