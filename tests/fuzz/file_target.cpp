#include <memory>
#include <optional>
#include <vector>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "io/tag/whole_bricks.h"
#include "pipeline/decode/graph.h"
#include "pipeline/verify/verify.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/targets.h"
#include "tests/support/graph_ends.h"
#include "tests/support/runs.h"
#include "tools/report/info.h"

namespace tagrid::fuzz {
namespace {

// Larger volumes are not decoded: a file of a few bytes can describe them, but they take too long.
constexpr std::int64_t most_samples = 1 << 11, most_brick_points = 1 << 12, most_bricks = 32;

bool is_small(const CodingParameters& p) {
  const Index3& n = p.dims;
  return n.x <= most_samples && n.y <= most_samples && n.z <= most_samples && n.x * n.y <= most_samples &&
         n.x * n.y * n.z <= most_samples && p.bricks().count() <= most_bricks &&
         p.bricks().closed_box({0, 0, 0}).count() <= most_brick_points;
}

/// The samples, or nothing if the file is broken or large.
std::optional<std::vector<std::byte>> samples_of(const std::string& path) {
  try {
    TagReader reader(path);
    if (!is_small(reader.parameters())) return std::nullopt;
    std::vector<std::byte> samples;
    RowsTo sink([&](const DecodedRows& rows) {
      rows.for_each_part([&](std::int64_t, std::span<const std::byte> part) {
        samples.insert(samples.end(), part.begin(), part.end());
      });
    });
    Watch unwatched;
    decode(decode_job_of(reader.parameters(), 1), reader, sink, unwatched);
    claim(samples.size() == *sample_bytes(reader.parameters().dims, reader.parameters().type),
          "a file that decodes has all its samples");
    return samples;
  } catch (const BrokenInput&) {
    return std::nullopt;
  }
}

/// Reads the index alone; returns true if the file is small and its index is intact.
bool report(const std::string& path) {
  try {
    const TagSummary file = summary_of(path);
    const TagSizes& sizes = file.sizes;
    claim(sizes.file == sizes.header + sizes.activity + sizes.values + sizes.envelope + sizes.members +
                            sizes.index + sizes.parity,
          "the parts sum to the file");
    claim(!info_json(file).dump().empty(), "any file can be reported");
    claim(!info_text(file).empty(), "any file can be printed");
    return is_small(file.header.parameters);
  } catch (const BrokenInput&) {
    return false;
  }
}

/// What of a small file is damaged; nothing if even its header is.
std::optional<Salvage> salvaged(const std::string& path, const std::string& output) {
  try {
    const TagHeader header = WholeBricks(std::make_shared<FileSource>(path)).header();
    if (!is_small(header.parameters)) return std::nullopt;
    Ranks alone;
    FinishedDecode decoded =
        decode_volume(alone, {.input = path,
                              .output = output,
                              .format = format_named("raw"),
                              .volume = header.volumes > 1 ? std::optional<std::int64_t>(0) : std::nullopt,
                              .numbers = Numbers::samples,
                              .fill = 0,
                              .resources = Resources(1)});
    return decoded.result.salvage;
  } catch (const BrokenInput&) {
    return std::nullopt;
  }
}

template <class Run>
bool is_accepted(Run run) {
  try {
    run();
    return true;
  } catch (const BrokenInput&) {
    return false;
  }
}

}  // namespace

void file(Bytes bytes) {
  const MemoryFile file(bytes);
  const bool whole_index = report(file.path());
  const auto samples = samples_of(file.path());
  claim(!samples || whole_index, "a file that decodes has a whole index");
  if (bytes.size() <= pipe_holds)
    claim(samples == samples_of(MemoryPipe(bytes).path()), "a pipe decodes as a file does");
  static const Folder folder;
  const auto salvage = salvaged(file.path(), folder.null_named("salvaged.raw"));
  claim(!samples || salvage, "a file that decodes can be salvaged");
  if (!whole_index) return;
  const bool verified = is_accepted([&] { verify_file(file.path(), std::nullopt, {}, Resources(1)); });
  claim(samples || !verified, "what does not decode is not verified");
  // An index may lie about the values of a brick.
  claim(!verified || salvage->lost.empty(), "of what is verified, all is whole");
  const bool meshed =
      is_accepted([&] { write_mesh(file.path(), folder.null_named("mesh.vtu"), {}, Resources(1)); });
  claim(meshed || !verified, "what is verified has a mesh");
  const bool coarsened = is_accepted([&] {
    write_mesh(file.path(), folder.null_named("mesh.vtu"), {{}, true, false, 3}, Resources(1));
  });
  claim(coarsened || !verified, "what is verified has a coarsest mesh");
  is_accepted([&] {
    // A header may say that each slice has a slope of its own, or that there is one slice.
    try {
      write_surface(file.path(), folder.null_named("surface.ply"), {.iso = 1, .close = true}, Resources(1));
    } catch (const UsageError&) {
    }
  });
  const bool counted = is_accepted([&] { summary_with_levels(file.path(), Resources(1)); });
  claim(counted || !verified, "what is verified has levels");
}

}  // namespace tagrid::fuzz
