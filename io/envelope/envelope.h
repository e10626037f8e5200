// The envelope of a volume: every byte of its files that is not a sample, so that the files can be given back
// byte for byte; or, if samples are compressed, of the same files in their plain form. docs/dev/format.md
// specifies its bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/volume/sample_places.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// What the bits of stored integers hold that do not belong to samples; see StoredBits.
enum class SpareBits : std::uint8_t {
  zero,  ///< or there are none
  sign,  ///< copies of the highest bit that counts
  kept,  ///< anything; the envelope has them
};

/// Some slices of the volume in a file.
struct SlicesInFile {
  std::int64_t first_slice = 0;  ///< the number of the first one in the volume
  SliceRun run;                  ///< without the number of the file
  SpareBits spare = SpareBits::zero;

  bool operator==(const SlicesInFile&) const = default;
};

/// A file of the source, or its plain form.
struct EnvelopeFile {
  std::string name;  ///< relative, with '/' between folders
  std::uint64_t size = 0;
  bool is_changed = false;  ///< the source has it in another form: compressed
  /// XXH3 of the file, if its samples are kept exactly; see look_at_content()
  std::optional<std::uint64_t> checksum;
  std::vector<SlicesInFile> slices;  ///< in the order of their bytes, which do not overlap

  bool operator==(const EnvelopeFile&) const = default;
};

/// The samples of a volume, as far as an envelope needs to know them.
struct SampleShape {
  Index3 dims;
  SampleType type = SampleType::uint8;

  SliceRows rows() const { return {static_cast<std::uint64_t>(dims.x) * size_of(type), dims.y}; }
  std::uint64_t slice_bytes() const { return *sample_bytes({dims.x, dims.y, 1}, type); }
  std::uint64_t bytes() const { return *sample_bytes(dims, type); }
};

/// Limits of an envelope: files, bytes of a name, and bytes in all files besides samples.
inline std::uint64_t most_files(const SampleShape& shape) {
  return static_cast<std::uint64_t>(shape.dims.z) + 1024;
}
inline constexpr std::size_t longest_envelope_name = 4096;
inline constexpr std::size_t longest_compression_name = 1024;
inline std::uint64_t most_other_bytes(const SampleShape& shape, std::uint64_t files) {
  return shape.bytes() / 2 + files * (std::uint64_t{1} << 16);
}

/// Takes the next bytes of an envelope.
using PutBytes = std::function<void(std::span<const std::byte>)>;

/// The files of a source, or the reason why they are not kept.
struct SourceFiles {
  /// Until look_at_content(), without checksums, and with spare bits that are zero.
  std::vector<EnvelopeFile> files;
  std::vector<std::string> names;               ///< of all files, also where no envelope can be made
  std::vector<std::vector<PlainPiece>> pieces;  ///< of which each file consists
  std::shared_ptr<OpenFiles> opened;            ///< the files of the source
  SampleShape shape;
  /// How the samples are compressed: their plain form is kept. "" if the files are kept as they are.
  std::string compression;
  std::optional<std::string> why_not;  ///< a sentence for users, if no envelope can be made
  std::vector<std::string> warnings;   ///< of the plain form

  /// Why the files cannot be given back byte for byte, if their samples are kept exactly; "" if they can.
  std::string why_not_restorable() const;
};

/// What restoring changes in samples of this compression(): "its samples are compressed (gzip), and come back
/// uncompressed". Readers of HDF5 call chunks without a filter "chunks".
std::string change_of_restoring(const std::string& compression);

/// Looks at the files of a source. Throws WorldError.
SourceFiles source_files(const SourceFacts& facts);

/// Reads files[number], and adds a checksum and what its spare bits hold. Threads may look at different files
/// at once. `exact`: the samples are kept exactly, and so is a checksum of the file. A file gets
/// no checksum if only a decoder knows some of its bytes. Throws WorldError, and BrokenInput if a file has
/// changed. REQUIRES: there is no why_not.
void look_at_content(SourceFiles& source, bool exact, std::size_t number);

/// Writes the envelope of these files. Calls `next_file` before each file with its number. Throws as
/// look_at_content() does. REQUIRES: there is no why_not; look_at_content() was called for all files.
void write_envelope(const SourceFiles& source, const PutBytes& put,
                    const std::function<void(std::size_t)>& next_file = {});

/// How often look_at_content() and write_envelope() together read a sample, on average. REQUIRES:
/// look_at_content() was called for all files.
double times_read_for_envelope(const SourceFiles& source, bool exact);

/// Gives the content of the next block of an envelope; false after the last one.
using NextBlock = std::function<bool(std::vector<std::byte>&)>;

/// Reads an envelope front to back. Wrong bytes throw BrokenInput.
class EnvelopeReader {
 public:
  /// `name` is that of the .tag file, for messages. `exact`: its samples are exact, so every file has a
  /// checksum. `compares_names`: it remembers the names of all files, and finds those that are there twice.
  EnvelopeReader(std::string name, const SampleShape& shape, bool exact, NextBlock next_block,
                 bool compares_names = true);

  /// Reads the description of the next file. Returns false after the last one, when every slice has its place
  /// and nothing follows. REQUIRES: the other bytes of the file before were read.
  bool next_file(EnvelopeFile& file);
  /// See SourceFiles::compression. REQUIRES: a file was read.
  const std::string& compression() const { return compression_; }
  /// Reads the other bytes of that file, and calls `use` with their position in the file. Samples whose spare
  /// bits are kept come, too: their spare bits as they were, and zeros for all other bits.
  void read_other_bytes(const EnvelopeFile& file,
                        const std::function<void(std::uint64_t, std::span<const std::byte>)>& use);

 private:
  [[noreturn]] void fail(const std::string& what) const;
  /// The next bytes, as many as there are without reading on; none at the end.
  std::span<const std::byte> ahead();
  /// Passes the next `size` bytes, in pieces.
  template <class Use>
  void take(std::uint64_t size, Use use);
  std::vector<std::byte> taken(std::size_t size);
  template <class T>
  T number();
  void read_beginning();
  void read_name(EnvelopeFile& file);
  SlicesInFile read_slices(std::uint64_t& end);

  std::string name_;
  SampleShape shape_;
  bool exact_, compares_names_;
  NextBlock next_block_;
  std::vector<std::byte> block_;
  std::size_t position_ = 0;  ///< in block_
  bool started_ = false, has_changed_ = false;
  std::string compression_;
  std::uint64_t files_left_ = 0, other_bytes_left_ = 0;
  std::set<std::string> names_;
  std::int64_t slices_left_ = 0;
  std::vector<bool> slices_;  ///< those that have their place
};

/// The compression() of an envelope that begins so. Throws BrokenInput; `name` is that of the .tag file.
std::string compression_in(const std::string& name, std::span<const std::byte> beginning);

/// Turns `count` samples at `samples` into the bytes that a file has for them: the inverse of reading them.
/// Spare bits that the envelope keeps (SpareBits::kept) become zero.
void to_stored(const SlicesInFile& slices, SampleType type, std::byte* samples, std::size_t count);

/// Calls `use` for every stretch of a file, front to back; `slices` is null for bytes that are not samples.
void for_each_stretch(
    const EnvelopeFile& file, const SampleShape& shape,
    const std::function<void(std::uint64_t begin, std::uint64_t end, const SlicesInFile* slices)>& use);

/// What an envelope may have many of.
struct EnvelopeSize {
  std::uint64_t files = 0, name_bytes = 0, runs = 0;
  std::uint64_t bytes = 0;  ///< of its content
};

/// Reads an envelope to its end, without remembering its files; see EnvelopeReader. Throws BrokenInput.
EnvelopeSize envelope_size(const std::string& name, const SampleShape& shape, bool exact,
                           NextBlock next_block);
/// The most that the envelope of these files can have. Throws WorldError.
EnvelopeSize envelope_size(const SourceFacts& facts);

/// Bytes of memory that the files of an envelope take when they are read, verified or restored.
std::uint64_t memory_of_files(const EnvelopeSize& size);
/// Bytes of memory that source_files() and write_envelope() take.
std::uint64_t memory_of_source_files(const SourceFacts& facts);

}  // namespace tagrid
