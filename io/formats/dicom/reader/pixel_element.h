// The element of the samples in a file: its head, the fragments in it (DICOM PS3.5, A.4), and what their code
// streams say.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/formats/dicom/reader/dicom_file.h"

namespace tagrid {

/// The length of an element that ends with a delimiter.
inline constexpr std::uint32_t unknown_length = 0xFFFFFFFF;

/// Reads the head before byte `offset` of a file: the bytes of the element; nothing if its length is not
/// defined, because it has fragments. Throws BrokenInput if there is none.
std::optional<std::uint64_t> pixel_length(const ByteSource& file, std::uint64_t offset, bool is_explicit,
                                          bool big_endian);

/// Checks that a file has all of its native samples, an element of `length` bytes from byte `offset` on;
/// notes bytes that are left over and are more than padding. Throws BrokenInput.
void check_native_pixels(DicomFile& file, const ByteSource& bytes, std::uint64_t length,
                         std::uint64_t offset);

/// Notes frames in the fragments from byte `begin` on that no attribute counts. Errors are left to the
/// decoder.
void check_streams(DicomFile& file, const ByteSource& bytes, std::uint64_t begin);

/// Notes bytes of samples that are more than the frames of a file have. REQUIRES: there are enough of them.
void note_bytes_left_over(DicomFile& file, std::uint64_t bytes);

/// Finds samples that lie plainly in the fragments from byte `begin` on: sets pixels.offset and pixels.step,
/// or pixels.stretches. Throws BrokenInput.
void find_plain_fragments(DicomFile& file, const ByteSource& bytes, std::uint64_t begin);

/// Reads a frame from pixels.stretches. Throws BrokenInput and WorldError.
void read_from_stretches(const DicomFile& file, std::size_t frame, std::byte* out);

/// The byte at which the code stream of the first frame begins, after the table of offsets. `fragments`: the
/// byte at which that table begins. The file may end before the stream. Throws BrokenInput if it ends before
/// the table.
std::uint64_t first_stream(const ByteSource& file, std::uint64_t fragments);

/// The bits of a sample in the code stream of the first frame, which is one of JPEG XL; nothing if it is damaged.
/// Throws WorldError. REQUIRES: pixels.encapsulated.
std::optional<int> bits_of_jpeg_xl(const DicomFile& file);

/// Notes a code stream of JPEG 2000 or JPEG XL without a sign, if the file says that samples have one. Throws
/// WorldError.
void note_stream_without_sign(DicomFile& file);

/// Whether the code stream of the first frame was made with a loss: by the irreversible wavelet of JPEG 2000
/// (9-7), as near-lossless JPEG-LS, or in the colors of JPEG XL. Nothing if the stream does not say, for it is
/// damaged, or of another kind. Throws WorldError. REQUIRES: pixels.encapsulated.
std::optional<bool> has_lossy_stream(const std::string& path, const DicomPixels& pixels);

// What code streams say of themselves, which may be other than what their file says: JPEG and RLE.

/// The frame header of a JPEG code stream (ISO 10918-1, B.2.2).
struct JpegFrame {
  int bits = 0, rows = 0, columns = 0, components = 0;
};

/// Nothing if the bytes, which are the beginning of a stream, have no frame header.
std::optional<JpegFrame> jpeg_frame(std::span<const std::byte> beginning);

/// Decodes a frame of RLE (DICOM PS3.5, annex G) to `count` integers of `size` bytes, in the machine's byte
/// order. The stream holds their most significant bytes first, then the next ones, and so on. Throws
/// BrokenInput if it holds other ones, fewer or more.
void decode_rle(std::span<const std::byte> stream, std::size_t size, std::size_t count, std::byte* out);

}  // namespace tagrid
