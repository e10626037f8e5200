#include "tools/formats/dicom/decoder.h"

#include <dcmtk/config/osconfig.h>
// The configuration comes first.
#include <dcmtk/dcmdata/dccodec.h>
#include <dcmtk/dcmdata/dcfcache.h>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <fmt/format.h>

#include <cstring>
#include <vector>

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

struct DicomDecoder::State {
  explicit State(const DicomFile& f) : file(f) {}

  [[noreturn]] void fail(std::string_view why) const {
    throw BrokenInput(fmt::format("{}: DICOM file: {} ({})", file.path, why, file.pixels.syntax_name));
  }

  /// All fragments of a frame, one after the other.
  std::vector<std::byte> stream_of(std::size_t frame) {
    DcmPixelSequence* fragments = nullptr;
    const auto frames = static_cast<Sint32>(file.frames.size());
    const E_TransferSyntax syntax = format.getDataset()->getOriginalXfer();
    if (pixels->getEncapsulatedRepresentation(syntax, nullptr, fragments).bad() || fragments == nullptr)
      fail("its pixels are missing");
    const auto start_of = [&](std::size_t number) -> Uint32 {
      Uint32 start = static_cast<Uint32>(fragments->card());
      if (number < file.frames.size() &&
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

  int read_jpeg2000(std::size_t frame, std::byte* out) {
    Jpeg2000Image image;
    try {
      image = decode_jpeg2000(stream_of(frame), file.pixels.columns, file.pixels.rows);
    } catch (const BrokenInput& error) {
      if (std::string_view(error.what()).starts_with(file.path)) throw;
      fail(error.what());
    }
    const std::size_t size = static_cast<std::size_t>(file.pixels.allocated) / 8;
    if (image.bits > file.pixels.allocated)
      fail(
          fmt::format("the code stream has {} bits, but a sample has {}", image.bits, file.pixels.allocated));
    for (std::size_t i = 0; i < image.samples.size(); ++i) {
      const auto bits = static_cast<std::uint32_t>(image.samples[i]);
      if (size == 1) {
        out[i] = static_cast<std::byte>(bits);
      } else if (size == 2) {
        const auto half = static_cast<std::uint16_t>(bits);
        std::memcpy(out + i * 2, &half, 2);
      } else {
        std::memcpy(out + i * 4, &bits, 4);
      }
    }
    return image.bits;
  }

  int read_other(std::size_t frame, std::byte* out) {
    // The library wants an even number of bytes.
    const std::uint64_t size = file.pixels.frame_bytes();
    buffer.resize(size + size % 2);
    OFString colors;
    // Without an offset table, the library finds only the frame that follows.
    if (frame != next_frame) next_fragment = 0;
    const OFCondition result =
        pixels->getUncompressedFrame(format.getDataset(), static_cast<Uint32>(frame), next_fragment,
                                     buffer.data(), static_cast<Uint32>(buffer.size()), colors, &cache);
    if (result.bad()) fail(fmt::format("frame {}: {}", frame + 1, result.text()));
    next_frame = frame + 1;
    std::memcpy(out, buffer.data(), size);
    return file.pixels.stored;
  }

  const DicomFile& file;
  DcmFileFormat format;
  DcmPixelData* pixels = nullptr;
  DcmFileCache cache;
  std::size_t next_frame = 0;
  Uint32 next_fragment = 0;  ///< of next_frame
  std::vector<std::byte> buffer;
};

DicomDecoder::DicomDecoder(const DicomFile& file) : state_(std::make_unique<State>(file)) {
  register_codecs();
  if (file.pixels.frame_bytes() >= std::uint64_t{1} << 31) state_->fail("a frame is too large to be decoded");
  // Fragments stay in the file until they are needed.
  const OFCondition result = state_->format.loadFile(file.path.c_str(), EXS_Unknown, EGL_noChange, 4096);
  if (result.bad()) state_->fail(result.text());
  DcmElement* element = nullptr;
  if (state_->format.getDataset()->findAndGetElement(DCM_PixelData, element).good())
    state_->pixels = dynamic_cast<DcmPixelData*>(element);
  if (state_->pixels == nullptr) state_->fail("its pixels are missing");
}

DicomDecoder::~DicomDecoder() = default;

const DicomFile& DicomDecoder::file() const { return state_->file; }

std::uint64_t DicomDecoder::bytes_of_samples() const { return state_->pixels->getLength(); }

int DicomDecoder::read_frame(std::size_t frame, std::byte* out) {
  const E_TransferSyntax syntax = state_->format.getDataset()->getOriginalXfer();
  const bool is_jpeg2000 = syntax == EXS_JPEG2000 || syntax == EXS_JPEG2000LosslessOnly;
  return is_jpeg2000 ? state_->read_jpeg2000(frame, out) : state_->read_other(frame, out);
}

}  // namespace tagrid
