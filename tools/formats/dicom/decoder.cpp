#include "tools/formats/dicom/decoder.h"

#include <dcmtk/dcmdata/dccodec.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <fmt/format.h>

#include <cstring>

#include "io/errors/errors.h"
#include "tools/formats/codecs/jpeg2000.h"

namespace tagrid {
namespace {

void register_codecs() {
  static const bool once = [] {
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    return true;
  }();
  static_cast<void>(once);
}

}  // namespace

void DicomDecoder::fail(std::string_view why) const {
  throw BrokenInput(fmt::format("{}: DICOM file: {} ({})", file_.path, why, file_.pixels.syntax_name));
}

/// All fragments of a frame, one after the other.
std::vector<std::byte> DicomDecoder::stream_of(std::size_t frame) {
  DcmPixelSequence* fragments = nullptr;
  const auto frames = static_cast<Sint32>(file_.frames.size());
  const E_TransferSyntax syntax = format_.getDataset()->getOriginalXfer();
  if (pixels_->getEncapsulatedRepresentation(syntax, nullptr, fragments).bad() || fragments == nullptr)
    fail("its pixels are missing");
  const auto start_of = [&](std::size_t number) -> Uint32 {
    Uint32 start = static_cast<Uint32>(fragments->card());
    if (number < file_.frames.size() &&
        DcmCodec::determineStartFragment(static_cast<Uint32>(number), frames, fragments, start).bad())
      fail(fmt::format("frame {} cannot be found", number + 1));
    return start;
  };
  std::vector<std::byte> bytes;
  const Uint32 end = start_of(frame + 1);
  for (Uint32 i = start_of(frame); i < end; ++i) {
    DcmPixelItem* fragment = nullptr;
    Uint8* data = nullptr;
    if (fragments->getItem(fragment, i).bad() || fragment->getUint8Array(data).bad() || data == nullptr)
      fail(fmt::format("frame {} is not complete", frame + 1));
    const auto* first = reinterpret_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), first, first + fragment->getLength());
    fragment->compact();  // the next reading is from the file again
  }
  return bytes;
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
  store_samples(image, size, out);
  return image.bits;
}

int DicomDecoder::read_other(std::size_t frame, std::byte* out) {
  // The library wants an even number of bytes.
  const std::uint64_t size = file_.pixels.frame_bytes();
  buffer_.resize(size + size % 2);
  OFString colors;
  // Without an offset table, the library finds only the frame that follows.
  if (frame != next_frame_) next_fragment_ = 0;
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
  const bool is_jpeg2000 = syntax == EXS_JPEG2000 || syntax == EXS_JPEG2000LosslessOnly;
  return is_jpeg2000 ? read_jpeg2000(frame, out) : read_other(frame, out);
}

}  // namespace tagrid
