// Parity of a file: written after it is complete, and used to repair it. docs/dev/format.md says what is stored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/parity/layout.h"

namespace tagrid {

/// Takes bytes at a position of a file.
using WriteAt = std::function<void(std::uint64_t position, std::span<const std::byte> bytes)>;

/// What the stripes that are read and coded at once may take: long reads are faster.
inline constexpr std::uint64_t usual_parity_memory = std::uint64_t{64} << 20;

/// Bytes of memory that the parity of a file needs at least, to write it or to repair the file: for one stripe
/// and the checksums of all blocks.
std::uint64_t least_parity_memory(const ParityLayout& layout);

/// Reads all bytes of `file` and writes their parity; its head will lie at `base`. Returns the position of
/// its end. `memory` is for stripes, of which there is always one; see least_parity_memory(). Throws WorldError
/// and UsageError.
std::uint64_t write_parity(const ByteSource& file, ParityShare share, std::uint64_t base,
                           const WriteAt& write, std::uint64_t memory = usual_parity_memory);

/// The path of the file that a symbolic link names; `path` itself if it is not a link.
std::string file_of_link(const std::string& path);
/// The path of the parity beside a file: of that one which a link names.
inline std::string parity_beside(const std::string& path) { return file_of_link(path) + ".parity"; }

/// Reads a damaged file in search of any description of the parity in it, which says how long the file is
/// without it. Nothing if none is left. Throws WorldError.
std::optional<ParityLayout> search_for_parity(const ByteSource& file);

/// Bytes `begin` to `end` - 1.
struct Stretch {
  std::uint64_t begin = 0, end = 0;
  bool operator==(const Stretch&) const = default;
};

/// The condition of a file with parity.
struct ParityCondition {
  std::vector<Stretch> damaged;      ///< blocks of the file whose bytes are wrong or missing, in order
  std::vector<Stretch> lost;         ///< those of them that parity cannot bring back
  std::uint64_t damaged_blocks = 0;  ///< of the file
  std::uint64_t damaged_parity = 0;  ///< blocks and pages of the parity
  bool damaged_frame = false;        ///< head or foot, or bytes are missing or follow
  bool wrong_size = false;           ///< of the file, if its parity is beside it
  std::uint64_t unknown_pages = 0;   ///< if not 0: so many pages of checksums are lost, and nothing is known

  bool is_intact() const {
    return is_file_intact() && damaged_parity == 0 && !damaged_frame && unknown_pages == 0;
  }
  /// True if only the parity is damaged. REQUIRES: unknown_pages == 0.
  bool is_file_intact() const { return damaged_blocks == 0 && !wrong_size; }
  bool is_repairable() const { return lost.empty() && unknown_pages == 0; }
};

/// A file, perhaps damaged, and its parity, in it or beside it.
class ProtectedFile {
 public:
  /// Finds parity in `file`, else in `beside`, which may be null. If the ends are damaged, reads everything
  /// in search of a description. Nothing if there is none, or if far too little of the file is left.
  static std::optional<ProtectedFile> find(std::shared_ptr<const ByteSource> file,
                                           std::shared_ptr<const ByteSource> beside = nullptr);

  const ParityLayout& layout() const { return layout_; }
  bool is_beside() const { return parity_ != file_; }
  /// Size of the file once it is repaired, with the parity that is in it.
  std::uint64_t whole_size() const { return is_beside() ? layout_.file_size : layout_.end(base_); }

  /// Reads everything and compares it with the checksums.
  ParityCondition survey(std::uint64_t memory = usual_parity_memory) const { return walk(nullptr, memory); }
  /// Also writes the repaired file, with parity if it is in it. What was written is right only if the
  /// condition is_repairable().
  ParityCondition repair(const WriteAt& write, std::uint64_t memory = usual_parity_memory) const {
    return walk(&write, memory);
  }

 private:
  ProtectedFile(std::shared_ptr<const ByteSource> file, std::shared_ptr<const ByteSource> parity,
                const ParityLayout& layout);
  ParityCondition walk(const WriteAt* write, std::uint64_t memory) const;
  /// Reads the table; nothing if too many pages are lost. Counts the damaged ones.
  std::optional<std::vector<std::uint64_t>> read_table(ParityCondition& condition) const;
  bool is_frame_intact() const;

  std::shared_ptr<const ByteSource> file_, parity_;  ///< the same if parity is in the file
  ParityLayout layout_;
  std::uint64_t base_ = 0;
};

/// True if a file has parity that its end shows, or parity beside it. Throws WorldError.
bool has_parity(const std::string& path);

/// Opens a file and, if there is one, the parity beside it. Throws WorldError.
std::optional<ProtectedFile> protected_file(const std::string& path);

/// Checksum of the table of the checksums of all blocks.
std::uint64_t id_of_table(std::span<const std::uint64_t> checksums);

}  // namespace tagrid
