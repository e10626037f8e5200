// A chunk of a data set as the bytes of a .tag file, and back.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "plugins/hdf5/settings.h"

namespace tagrid::hdf5 {

/// The chunk as a .tag file without a stored grid: of the samples, or of their places on a lattice
/// (lattice.h). Throws Error.
///
///   samples  x fastest, in the byte order of the chunk
///
/// REQUIRES: samples.size() == chunk.bytes().
std::vector<std::byte> encode(const Chunk& chunk, const Choice& choice, std::span<const std::byte> samples);

/// The bytes of a .tag file, whoever made it, as a chunk.
class StoredChunk {
 public:
  /// Throws Error if the file is damaged at its head or its end, its samples are not of the chunk's type and
  /// size, or they may be off by more than what was chosen. `file` must outlive the object.
  StoredChunk(const Chunk& chunk, const Choice& choice, std::span<const std::byte> file);
  StoredChunk(const StoredChunk&) = delete;
  StoredChunk& operator=(const StoredChunk&) = delete;

  /// Writes the samples in the byte order of the chunk. Throws Error if the file is damaged.
  /// REQUIRES: samples.size() == chunk.bytes().
  void decode_to(std::span<std::byte> samples) const;

 private:
  class Memory final : public Input {
   public:
    explicit Memory(std::span<const std::byte> bytes) : bytes_(bytes) {}
    std::uint64_t size() override { return bytes_.size(); }
    void read_at(std::uint64_t offset, std::span<std::byte> to) override;

   private:
    std::span<const std::byte> bytes_;
  };

  Chunk chunk_;
  double max_error_;
  Memory memory_;
  Reader reader_;
  std::string header_;
};

}  // namespace tagrid::hdf5
