// The bytes of a file in its plain form.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/compressed_bytes.h"
#include "io/files/file_bytes.h"
#include "io/files/open_files.h"
#include "io/volume/sample_places.h"

namespace tagrid {

/// Reads such a file at any place. Going back in a compressed stream starts at its beginning. Throws
/// WorldError, and BrokenInput if a file has changed since it was described.
class PlainBytes {
 public:
  /// `files` are those of the source. Both must outlive this.
  PlainBytes(const std::vector<PlainPiece>& pieces, OpenFiles& files);

  /// The size of the file. Reads contents of unknown sizes to their ends.
  std::uint64_t size();
  /// False if there are samples that only their decoder can give.
  bool is_complete() const;
  /// True if there are no such samples among the bytes [begin, end).
  bool has_bytes(std::uint64_t begin, std::uint64_t end);
  /// Fills `to` with the bytes from `position` on. REQUIRES: they exist, and are not such samples.
  void read_at(std::uint64_t position, std::span<std::byte> to);

 private:
  /// An open stream.
  struct Content {
    explicit Content(const std::string& path, std::uint64_t offset);
    std::size_t read(std::span<std::byte> to);

    FileBytes file;
    std::optional<CompressedBytes> bytes;
    std::uint64_t position = 0;
  };

  std::uint64_t size_of(std::size_t piece);
  [[noreturn]] void fail_changed(std::size_t piece) const;
  void read_piece(std::size_t piece, std::uint64_t position, std::span<std::byte> to);
  void read_content(std::size_t piece, std::uint64_t position, std::span<std::byte> to);

  const std::vector<PlainPiece>& pieces_;
  OpenFiles& files_;
  std::vector<std::uint64_t> sizes_;  ///< of contents, once they are known; 0: unknown
  // One of each is open at a time.
  std::shared_ptr<const FileSource> file_;
  std::size_t number_of_file_ = 0;
  std::unique_ptr<Content> content_;
  std::size_t piece_of_content_ = 0;
};

}  // namespace tagrid
