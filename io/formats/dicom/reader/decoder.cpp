#include "io/formats/dicom/reader/decoder.h"

#include <dcmtk/dcmdata/dccodec.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "io/errors/errors.h"
#include "io/formats/codecs/jpeg2000.h"
#include "io/formats/dicom/reader/pixel_element.h"
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

}  // namespace

void DicomDecoder::fail(std::string_view why) const {
  throw BrokenInput(fmt::format("{}: DICOM file: {} ({})", file_.path, why, file_.pixels.syntax_name));
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

/// Fragments from `begin` on, one after the other, at most to `end`, until they have so many bytes.
std::vector<std::byte> DicomDecoder::stream_from(Uint32 begin, Uint32 end, std::size_t enough) {
  std::vector<std::byte> bytes;
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

/// All fragments of a frame, one after the other.
std::vector<std::byte> DicomDecoder::stream_of(std::size_t frame) {
  return stream_from(fragment_of(frame), fragment_of(frame + 1), std::numeric_limits<std::size_t>::max());
}

int DicomDecoder::read_jpeg2000(std::size_t frame, std::byte* out) {
  Jpeg2000Image image;
  try {
    image = decode_jpeg2000(stream_of(frame), file_.pixels.columns, file_.pixels.rows);
  } catch (const BrokenInput& error) {
    if (std::string_view(error.what()).starts_with(file_.path)) throw;
    fail(error.what());
  }
  const std::size_t size = static_cast<std::size_t>(file_.pixels.allocated) / 8;
  if (image.bits > file_.pixels.allocated)
    fail(fmt::format("the code stream has {} bits, but a sample has {}", image.bits, file_.pixels.allocated));
  if (image.is_signed && !file_.pixels.is_signed &&
      std::ranges::any_of(image.samples, [](std::int32_t sample) { return sample < 0; }))
    fail(fmt::format(
        "frame {}: the code stream has negative samples, but the file says that samples have no sign "
        "(PixelRepresentation)",
        frame + 1));
  store_samples(image, size, out);
  return image.bits;
}

int DicomDecoder::read_rle(std::size_t frame, std::byte* out) {
  const DicomPixels& pixels = file_.pixels;
  try {
    decode_rle(stream_of(frame), static_cast<std::size_t>(pixels.allocated) / 8,
               static_cast<std::size_t>(pixels.columns * pixels.rows), out);
  } catch (const BrokenInput& error) {
    if (std::string_view(error.what()).starts_with(file_.path)) throw;
    fail(fmt::format("frame {}: {}", frame + 1, error.what()));
  }
  return pixels.stored;
}

/// The library decodes whatever a stream holds, into the space of what the file says.
void DicomDecoder::check_jpeg_frame(std::size_t frame) {
  constexpr std::size_t most_bytes = 1 << 16;
  const DicomPixels& pixels = file_.pixels;
  const auto found =
      jpeg_frame(stream_from(next_fragment_, static_cast<Uint32>(fragments().card()), most_bytes));
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
  register_codecs();
  if (file.pixels.frame_bytes() >= std::uint64_t{1} << 31) fail("a frame is too large to be decoded");
  // Fragments stay in the file until they are needed.
  const OFCondition result = format_.loadFile(file.path.c_str(), EXS_Unknown, EGL_noChange, 4096);
  if (result.bad()) fail(result.text());
  DcmElement* element = nullptr;
  if (format_.getDataset()->findAndGetElement(DCM_PixelData, element).good())
    pixels_ = dynamic_cast<DcmPixelData*>(element);
  if (pixels_ == nullptr) fail("its pixels are missing");
}

int DicomDecoder::read_frame(std::size_t frame, std::byte* out) {
  const E_TransferSyntax syntax = format_.getDataset()->getOriginalXfer();
  if (syntax == EXS_RLELossless) return read_rle(frame, out);
  const bool is_jpeg2000 = syntax == EXS_JPEG2000 || syntax == EXS_JPEG2000LosslessOnly;
  return is_jpeg2000 ? read_jpeg2000(frame, out) : read_other(frame, out);
}

}  // namespace tagrid
