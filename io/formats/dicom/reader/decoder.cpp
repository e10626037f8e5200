#include "io/formats/dicom/reader/decoder.h"

#include <dcmtk/dcmdata/dccodec.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>

#include "io/errors/errors.h"
#include "io/formats/codecs/jpeg2000.h"
#include "io/formats/dicom/reader/jpeg_xl.h"
#include "io/formats/dicom/reader/pixel_element.h"
#include "io/samples/stored_bits.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

void register_codecs() {
  static const bool once = [] {
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    return true;
  }();
  static_cast<void>(once);
}

/// JPEG of ISO 10918-1, which JPEG-LS and JPEG 2000 are not.
bool is_jpeg(E_TransferSyntax syntax) {
  return syntax == EXS_JPEGProcess1 || syntax == EXS_JPEGProcess2_4 || syntax == EXS_JPEGProcess14 ||
         syntax == EXS_JPEGProcess14SV1;
}

/// True for code streams that DCMTK does not decode, or not as it should: it takes whatever RLE holds.
bool is_decoded_here(const DicomPixels& pixels) {
  return pixels.is_jpeg2000() || pixels.is_jpeg_xl() || pixels.syntax == UID_RLELosslessTransferSyntax;
}

int read_jpeg2000(std::span<const std::byte> stream, const DicomPixels& pixels, std::byte* out) {
  const Jpeg2000Image image = decode_jpeg2000(stream, pixels.columns, pixels.rows);
  if (image.bits > pixels.allocated)
    throw BrokenInput("the code stream has {} bits, but a sample has {}", image.bits, pixels.allocated);
  if (image.is_signed && !pixels.is_signed &&
      std::ranges::any_of(image.samples, [](std::int32_t sample) { return sample < 0; }))
    throw BrokenInput(
        "the code stream has negative samples, but the file says that samples have no sign "
        "(PixelRepresentation)");
  store_samples(image, static_cast<std::size_t>(pixels.allocated) / 8, out);
  return image.bits;
}

int read_jpeg_xl(std::span<const std::byte> stream, const DicomPixels& pixels, std::byte* out) {
  const JpegXlImage image = decode_jpeg_xl(stream, pixels.columns, pixels.rows);
  if (image.bits > pixels.allocated)
    throw BrokenInput("the code stream has {} bits, but a sample has {}", image.bits, pixels.allocated);
  with_bits_of(static_cast<std::size_t>(pixels.allocated) / 8, [&]<class Bits>(Bits) {
    for (const std::uint16_t sample : image.samples) {
      const auto bits = static_cast<Bits>(sample);
      std::memcpy(out, &bits, sizeof bits);
      out += sizeof bits;
    }
  });
  return image.bits;
}

}  // namespace

void DicomDecoder::fail(std::string_view why) const {
  throw BrokenInput("{}: DICOM file: {} ({})", file_.path, why, file_.pixels.syntax_name);
}

DcmPixelSequence& DicomDecoder::fragments() {
  DcmPixelSequence* fragments = nullptr;
  const E_TransferSyntax syntax = format_.getDataset()->getOriginalXfer();
  if (pixels_->getEncapsulatedRepresentation(syntax, nullptr, fragments).bad() || fragments == nullptr)
    fail("its pixels are missing");
  return *fragments;
}

/// The number of the fragment with which a frame begins.
Uint32 DicomDecoder::fragment_of(std::size_t frame) {
  Uint32 start = static_cast<Uint32>(fragments().card());
  const auto frames = static_cast<Sint32>(file_.frames.size());
  if (frame < file_.frames.size() &&
      DcmCodec::determineStartFragment(static_cast<Uint32>(frame), frames, &fragments(), start).bad())
    fail(fmt::format("frame {} cannot be found", frame + 1));
  return start;
}

/// Fragments from `begin` on, one after the other, until they have so many bytes.
std::vector<std::byte> DicomDecoder::beginning_from(Uint32 begin, std::size_t enough) {
  std::vector<std::byte> bytes;
  const auto end = static_cast<Uint32>(fragments().card());
  for (Uint32 i = begin; i < end && bytes.size() < enough; ++i) {
    DcmPixelItem* fragment = nullptr;
    Uint8* data = nullptr;
    if (fragments().getItem(fragment, i).bad() || fragment->getUint8Array(data).bad() || data == nullptr)
      fail(fmt::format("fragment {} is not complete", i));
    const auto* first = reinterpret_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), first, first + fragment->getLength());
    fragment->compact();  // the next reading is from the file again
  }
  return bytes;
}

int DicomDecoder::read_stream(std::size_t frame, std::byte* out) try {
  const std::vector<std::byte> stream = streams_->stream_of(frame);
  const DicomPixels& pixels = file_.pixels;
  if (pixels.is_jpeg2000()) return read_jpeg2000(stream, pixels, out);
  if (pixels.is_jpeg_xl()) return read_jpeg_xl(stream, pixels, out);
  decode_rle(stream, static_cast<std::size_t>(pixels.allocated) / 8,
             static_cast<std::size_t>(pixels.columns * pixels.rows), out);
  return pixels.stored;
} catch (const BrokenInput& error) {
  fail(fmt::format("frame {}: {}", frame + 1, error.what()));
}

/// The library decodes whatever a stream holds, into the space of what the file says.
void DicomDecoder::check_jpeg_frame(std::size_t frame) {
  constexpr std::size_t most_bytes = 1 << 16;
  const DicomPixels& pixels = file_.pixels;
  const auto found = jpeg_frame(beginning_from(next_fragment_, most_bytes));
  if (!found) fail(fmt::format("frame {}: its code stream has no header", frame + 1));
  if (found->columns != pixels.columns || found->rows != pixels.rows || found->components != 1 ||
      (found->bits > 8 ? 16 : 8) != pixels.allocated)
    fail(fmt::format(
        "frame {}: the code stream has {} x {} samples of {} bits in {}, but {} x {} samples in {} "
        "bits are expected",
        frame + 1, found->columns, found->rows, found->bits,
        counted(static_cast<std::uint64_t>(found->components), "component"), pixels.columns, pixels.rows,
        pixels.allocated));
}

int DicomDecoder::read_other(std::size_t frame, std::byte* out) {
  // The library wants an even number of bytes.
  const std::uint64_t size = file_.pixels.frame_bytes();
  buffer_.resize(size + size % 2);
  OFString colors;
  // Without an offset table, the library finds only the frame that follows.
  if (frame != next_frame_) next_fragment_ = 0;
  if (is_jpeg(format_.getDataset()->getOriginalXfer())) {
    if (next_fragment_ == 0) next_fragment_ = fragment_of(frame);
    check_jpeg_frame(frame);
  }
  const OFCondition result =
      pixels_->getUncompressedFrame(format_.getDataset(), static_cast<Uint32>(frame), next_fragment_,
                                    buffer_.data(), static_cast<Uint32>(buffer_.size()), colors, &cache_);
  if (result.bad()) fail(fmt::format("frame {}: {}", frame + 1, result.text()));
  next_frame_ = frame + 1;
  std::memcpy(out, buffer_.data(), size);
  return file_.pixels.stored;
}

DicomDecoder::DicomDecoder(const DicomFile& file) : file_(file) {
  if (file.pixels.frame_bytes() >= std::uint64_t{1} << 31) fail("a frame is too large to be decoded");
  if (file.pixels.encapsulated && is_decoded_here(file.pixels)) {
    try {
      streams_.emplace(file);
    } catch (const BrokenInput& error) {
      fail(error.what());
    }
    return;
  }
  register_codecs();
  // Fragments stay in the file until they are needed.
  const OFCondition result =
      format_.loadFile(OFFilename(path_of(file.path).c_str()), EXS_Unknown, EGL_noChange, 4096);
  if (result.bad()) fail(result.text());
  DcmElement* element = nullptr;
  if (format_.getDataset()->findAndGetElement(DCM_PixelData, element).good())
    pixels_ = dynamic_cast<DcmPixelData*>(element);
  if (pixels_ == nullptr) fail("its pixels are missing");
}

int DicomDecoder::read_frame(std::size_t frame, std::byte* out) {
  return streams_ ? read_stream(frame, out) : read_other(frame, out);
}

}  // namespace tagrid
