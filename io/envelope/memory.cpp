#include <algorithm>
#include <bit>
#include <utility>

#include "io/envelope/envelope.h"
#include "io/files/file_attributes.h"

namespace tagrid {
namespace {

/// Of an allocation, besides its bytes.
constexpr std::uint64_t allocation = 16;
constexpr std::uint64_t of_text = sizeof(std::string) + allocation;
/// A run, as it is described and as it is found by its slices; the vectors may have twice the room.
constexpr std::uint64_t of_run = 4 * sizeof(SlicesInFile) + allocation;
/// What a description has of a file besides its name, and of a run.
constexpr std::uint64_t file_bytes = 32, run_bytes = 48;

/// Bytes of the largest block of an envelope.
std::uint64_t block_bytes(std::uint64_t bytes) { return std::min(bytes, std::uint64_t{1} << 20); }

/// All bytes of files that are not samples, at most.
std::uint64_t other_bytes(const SourceFacts& facts) {
  const SampleShape shape{facts.info.dims, facts.info.type};
  // The files of a plain form are not made for this.
  if (facts.places.empty()) return facts.files.size() << 16;
  const std::uint64_t all = size_of_files(facts.files);
  return std::min(all - std::min(all, shape.bytes()), most_other_bytes(shape, facts.files.size()));
}

}  // namespace

EnvelopeSize envelope_size(const std::string& name, const SampleShape& shape, bool exact,
                           NextBlock next_block) {
  EnvelopeReader reader(name, shape, exact, std::move(next_block), false);
  EnvelopeSize size;
  for (EnvelopeFile file; reader.next_file(file);) {
    reader.read_other_bytes(file, [](std::uint64_t, std::span<const std::byte>) {});
    ++size.files;
    size.name_bytes += file.name.size();
    size.runs += file.slices.size();
    size.bytes += file_bytes + file.name.size() + run_bytes * file.slices.size() + file.size;
    for (const SlicesInFile& slices : file.slices)
      size.bytes -= static_cast<std::uint64_t>(slices.run.slices) * shape.slice_bytes();
  }
  return size;
}

EnvelopeSize envelope_size(const SourceFacts& facts) {
  EnvelopeSize size;
  size.files = facts.files.size();
  for (const std::string& file : facts.files) size.name_bytes += file.size();
  // In a plain form, every slice may be a run.
  size.runs = facts.places.empty() ? static_cast<std::uint64_t>(facts.info.dims.z) : facts.places.size();
  size.bytes = size.files * file_bytes + size.name_bytes + size.runs * run_bytes + other_bytes(facts);
  return size;
}

std::uint64_t memory_of_files(const EnvelopeSize& size) {
  // The files, a copy of them for the result, and the set of their names; vectors may have twice the room.
  constexpr std::uint64_t file = 4 * sizeof(EnvelopeFile) + 4 * of_text + 64;
  // A block, packed and unpacked.
  return size.files * file + 5 * size.name_bytes + 2 * size.runs * of_run + 4 * block_bytes(size.bytes);
}

std::uint64_t memory_of_source_files(const SourceFacts& facts) {
  if (facts.places.empty() && !facts.plain_form) return 0;
  const EnvelopeSize size = envelope_size(facts);
  // Paths of the source and of its plain form, whole paths, names, and the set of names; pieces.
  constexpr std::uint64_t file =
      2 * (sizeof(PlainFile) + sizeof(EnvelopeFile) + sizeof(std::vector<PlainPiece>)) + 8 * of_text + 64;
  // A block, three times, and the tables of zstd for one of its size.
  const std::uint64_t block = block_bytes(size.bytes), writing = 4 * block + 16 * std::bit_ceil(block);
  // A file has many pieces if it has many slices: pages with their tags.
  const std::uint64_t pieces =
      facts.plain_form ? std::max(size.files, size.runs) * (8 * (sizeof(PlainPiece) + allocation) + 600)
                       : size.files * 2 * sizeof(PlainPiece);
  return size.files * file + pieces + 8 * size.name_bytes + size.runs * (of_run + 2 * sizeof(SliceRun)) +
         writing;
}

}  // namespace tagrid
