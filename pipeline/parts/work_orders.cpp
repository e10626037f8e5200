#include "pipeline/parts/work_orders.h"

#include <algorithm>
#include <exception>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/files/output_file.h"
#include "io/files/temporaries.h"
#include "io/tag/bricks.h"
#include "pipeline/decode/graph.h"
#include "pipeline/parts/mesh_parts.h"
#include "pipeline/parts/order_members.h"
#include "pipeline/ranks/messages.h"
#include "pipeline/restore/restore.h"

namespace tagrid {
namespace {

enum class Task : std::uint8_t {
  end,
  make_parts,
  place_parts,
  decode_parts,
  verify_parts,
  look_at_share,
  mesh_parts,
  of_program
};

// Sends an order. The task comes last in the message.
void send(Ranks& ranks, Task task, Bytes order) {
  if (ranks.count() == 1) return;
  order.push_back(static_cast<std::byte>(task));
  ranks.broadcast(order);
}

// Unpacks an order and carries it out. Ignores failures: rank 0 reports them, and then sends the final order.
template <class Order, class Do>
void obey(const Bytes& bytes, const std::function<void(std::uint64_t)>& limit_memory, Do work) {
  auto order = unpacked_order<Order>(bytes);
  if constexpr (requires { order.resources; })
    if (order.resources.memory) limit_memory(*order.resources.memory);
  try {
    work(order);
  } catch (const std::exception&) {
  }
}

// The file and the output volume, as opened by this rank.
class PartDecoder {
 public:
  PartDecoder(const Ranks& ranks, const DecodeOrder& order)
      : start_(order.start),
        tag_(std::make_shared<FileSource>(order.input)),
        file_(order.file, order.name),
        sample_bytes_(size_of(order.numbers.type(parameters().type))),
        parts_(parts_of(parameters().bricks())),
        budget_(plan_decoding(parameters(), of_this_rank(ranks, order.resources), DecodeUse::write, 0,
                              order.numbers.value_bytes())
                    .budget),
        numbers_(order.numbers) {}

  const CodingParameters& parameters() const { return tag_.parameters(); }
  std::int64_t count() const { return static_cast<std::int64_t>(parts_.size()); }

  void decode(std::int64_t part, Watch& watch) {
    const BrickRows& rows = parts_[static_cast<std::size_t>(part)];
    BricksInOrder bricks(tag_, rows.first_brick(parameters().bricks()));
    RowsTo sink([&](const DecodedRows& decoded) {
      decoded.for_each_part_at_once(
          [&](std::int64_t first, std::span<const std::byte> samples) { write(first, samples); });
    });
    tagrid::decode({parameters(), budget_, rows, numbers_}, bricks, sink, watch);
  }

  void finish() { file_.finish(); }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) {
    std::vector<std::byte> swapped;
    file_.write_at(start_ + static_cast<std::uint64_t>(first) * sample_bytes_,
                   little_endian_samples(samples, sample_bytes_, swapped));
  }

  std::uint64_t start_;
  TagBricks tag_;
  PlacedFile file_;
  std::size_t sample_bytes_;  ///< as written
  std::vector<BrickRows> parts_;
  DecodeBudget budget_;
  WrittenNumbers numbers_;
};

// Messages between ranks are small.
constexpr std::size_t files_at_once = 4096;

/// Some files of a source, and no others.
SourceFiles only(const SourceFiles& all, std::size_t first, std::size_t end) {
  SourceFiles some;
  some.shape = all.shape;
  std::map<std::size_t, std::size_t> numbers;  // of paths, there and here
  std::vector<std::string> paths;
  for (std::size_t i = first; i < end; ++i) {
    some.files.push_back(all.files[i]);
    some.pieces.push_back(all.pieces[i]);
    for (PlainPiece& piece : some.pieces.back()) {
      if (piece.kind != PlainPiece::Kind::stretch && piece.kind != PlainPiece::Kind::content) continue;
      const auto [number, is_new] = numbers.emplace(piece.file, paths.size());
      if (is_new) paths.push_back(all.opened->paths()[piece.file]);
      piece.file = number->second;
    }
  }
  some.opened = std::make_shared<OpenFiles>(std::move(paths));
  return some;
}

}  // namespace

void send_order(Ranks& ranks, const PartOrder& order) { send(ranks, Task::make_parts, packed_order(order)); }
void send_order(Ranks& ranks, const PlaceOrder& order) {
  send(ranks, Task::place_parts, packed_order(order));
}
void send_order(Ranks& ranks, const DecodeOrder& order) {
  send(ranks, Task::decode_parts, packed_order(order));
}
void send_order(Ranks& ranks, const VerifyOrder& order) {
  send(ranks, Task::verify_parts, packed_order(order));
}
void send_order(Ranks& ranks, const ContentOrder& order) {
  send(ranks, Task::look_at_share, packed_order(order));
}
void send_order(Ranks& ranks, const MeshOrder& order) { send(ranks, Task::mesh_parts, packed_order(order)); }
void send_order(Ranks& ranks, const Bytes& order) { send(ranks, Task::of_program, order); }

void dismiss(Ranks& ranks, int code) {
  FieldWriter fields;
  fields.put(code);
  send(ranks, Task::end, fields.bytes());
}

int serve(Ranks& ranks, const std::function<void(std::uint64_t)>& limit_memory,
          const std::function<void(const Bytes&)>& obey_program) {
  for (;;) {
    Bytes bytes;
    ranks.broadcast(bytes);
    const Task task = static_cast<Task>(bytes.back());
    bytes.pop_back();
    switch (task) {
      case Task::end:
        return FieldReader(bytes).get<int>();
      case Task::make_parts: {
        int slot = -1;
        obey<PartOrder>(bytes, limit_memory, [&](const PartOrder& order) {
          // A run that can be continued leaves its parts. In others, each rank ensures that nothing is left.
          if (order.code_after_signal < 0)
            slot = register_temporary_folder(order.folder);
          else
            end_signals_with(order.code_after_signal, "");
          make_parts(ranks, order);
        });
        forget_temporary(slot);
        break;
      }
      case Task::place_parts:
        obey<PlaceOrder>(bytes, limit_memory, [&](const PlaceOrder& order) { place_parts(ranks, order); });
        break;
      case Task::decode_parts:
        obey<DecodeOrder>(bytes, limit_memory, [&](const DecodeOrder& order) { decode_parts(ranks, order); });
        break;
      case Task::verify_parts:
        obey<VerifyOrder>(bytes, limit_memory, [&](const VerifyOrder& order) { verify_parts(ranks, order); });
        break;
      case Task::look_at_share:
        obey<ContentOrder>(bytes, limit_memory, [&](ContentOrder& order) { look_at_share(ranks, order); });
        break;
      case Task::mesh_parts:
        obey<MeshOrder>(bytes, limit_memory, [&](const MeshOrder& order) {
          BrickSpool bricks(SpoolFile::beside("-"));
          mesh_parts(ranks, order, bricks);
        });
        break;
      case Task::of_program:
        obey_program(bytes);
        break;
      default:
        throw std::logic_error("a task from rank 0 cannot be read");
    }
  }
}

void decode_parts(Ranks& ranks, const DecodeOrder& order, const Progress& progress) {
  std::unique_ptr<PartDecoder> decoder;
  all_do(ranks, [&] { decoder = std::make_unique<PartDecoder>(ranks, order); });
  SharedWork shared;
  SharedWatch watch(shared);
  shared.count = decoder->count();
  shared.work = [&](std::int64_t part) { decoder->decode(part, watch); };
  CodingParameters written = decoder->parameters();
  written.type = order.numbers.type(written.type);
  shared.look = look_for(progress, written);
  share_out(ranks, shared);
  all_do(ranks, [&] { decoder->finish(); });
}

void look_at_share(Ranks& ranks, ContentOrder& order) {
  const std::size_t files = order.source.files.size(), count = static_cast<std::size_t>(ranks.count());
  const auto begin_of = [&](std::size_t rank) { return files * rank / count; };
  const auto rank = static_cast<std::size_t>(ranks.rank());
  SourceFiles own;
  all_do(ranks, [&] {
    if (!order.source.opened) order.source.opened = std::make_shared<OpenFiles>(order.paths);
    own = only(order.source, begin_of(rank), begin_of(rank + 1));
    look_at_contents(own, order.exact, of_this_rank(ranks, order.resources).threads);
  });
  const std::vector<Bytes> seen = ranks.gather(packed_order(own.files));
  for (std::size_t other = 0; other < seen.size(); ++other)
    std::ranges::move(unpacked_order<std::vector<EnvelopeFile>>(seen[other]),
                      order.source.files.begin() + static_cast<std::ptrdiff_t>(begin_of(other)));
}

void share_contents(Ranks& ranks, SourceFiles& source, bool exact, const Resources& resources) {
  for (std::size_t first = 0; first < source.files.size(); first += files_at_once) {
    const std::size_t end = std::min(first + files_at_once, source.files.size());
    ContentOrder order{only(source, first, end), {}, exact, resources};
    order.paths = order.source.opened->paths();
    send_order(ranks, order);
    look_at_share(ranks, order);
    std::ranges::move(order.source.files, source.files.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

VerifyResult verify_parts(Ranks& ranks, const VerifyOrder& order, std::optional<VerifySetup> setup,
                          const Progress& progress) {
  std::optional<TagBricks> file;
  std::optional<Verifier> verifier;
  all_do(ranks, [&] {
    file.emplace(std::make_shared<FileSource>(order.input));
    if (!setup)
      setup = verify_setup(file->name(), file->header(), order.original, order.source,
                           of_this_rank(ranks, order.resources));
    verifier.emplace(*file, file->index(), std::move(*setup));
  });
  const BrickGrid bricks = verifier->parameters().bricks();
  const std::vector<BrickRows> parts = parts_of(bricks);
  Statistics counted;
  bool has_points = true;  // of all parts: ranks may have more memory or less
  OpenFacePairs faces(bricks);
  SharedWork shared;
  SharedWatch watch(shared);
  shared.count = static_cast<std::int64_t>(parts.size());
  shared.work = [&](std::int64_t part) {
    shared.account = packed_order(verifier->verify(parts[static_cast<std::size_t>(part)], watch));
  };
  shared.take = [&](const Bytes& bytes) {
    const auto found = unpacked_order<Findings>(bytes);
    counted.add(found.counted);
    has_points &= found.has_points;
    faces.add(found.open_faces);
  };
  shared.look = look_for(progress, verifier->parameters());
  share_out(ranks, shared);
  if (ranks.rank() > 0) return {};
  if (const auto bricks_that_differ = has_points ? faces.first_difference() : std::nullopt)
    verifier->tell_difference(*bricks_that_differ);
  return verifier->finish(counted, has_points, file->sizes());
}

}  // namespace tagrid
