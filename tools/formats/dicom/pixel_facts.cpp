#include "tools/formats/dicom/pixel_facts.h"

#include <fmt/format.h>

#include "io/errors/errors.h"
#include "io/text/text.h"
#include "tools/formats/dicom/code_stream.h"
#include "tools/formats/dicom/frames.h"
#include "tools/formats/dicom/rescaling.h"
#include "tools/formats/dicom/transfer_syntax.h"

namespace tagrid {
namespace {

void not_understood(DicomFile& file, const char* about, std::string text) {
  DicomNotes::add(file.notes.not_understood, about, std::move(text));
}

/// A number that every image must have; `otherwise` and a note if it is absent.
std::int64_t required(DcmDataset& dataset, const DcmTagKey& tag, std::int64_t otherwise, DicomFile& file) {
  const auto number = integer_in(dataset, tag);
  if (!number)
    not_understood(file, name_of(tag).c_str(),
                   fmt::format("{} is {}; it is taken as {}", name_of(tag),
                               dataset.tagExists(tag) ? "empty" : "absent", otherwise));
  return number.value_or(otherwise);
}

/// Overlays that lie in bits of the pixels, as older files have them (DICOM PS3.3, C.9.2, retired).
void note_overlays(DcmDataset& dataset, DicomFile& file) {
  for (Uint16 group = 0x6000; group <= 0x601E; group = static_cast<Uint16>(group + 2))
    if (integer_in(dataset, DcmTagKey(group, 0x0100)).value_or(1) > 1 &&
        !dataset.tagExists(DcmTagKey(group, 0x3000)))
      not_understood(
          file, "OverlayBitPosition",
          "it has an overlay in bits of its pixels (OverlayBitPosition); only the samples are kept");
}

/// Attributes that say that samples are not plain numbers, or not only.
void note_what_samples_mean(DcmDataset& dataset, DicomFile& file) {
  note_tables(dataset, file.notes);
  note_overlays(dataset, file);
  const std::string presentation = text_of(dataset, DCM_PixelPresentation).value_or("MONOCHROME");
  const bool has_palette = dataset.tagExists(DCM_RedPaletteColorLookupTableDescriptor);
  if (presentation.ends_with("COLOR") || presentation.ends_with("MIXED") || has_palette)
    not_understood(file, "PixelPresentation",
                   "some of its samples are numbers of colors (a supplemental palette), and no values");
  if (file.pixels.photometric == "MONOCHROME1" ||
      text_of(dataset, DCM_PresentationLUTShape).value_or("") == "INVERSE")
    DicomNotes::add(file.notes.warnings, "PhotometricInterpretation",
                    fmt::format("small numbers mean white in these images ({}); numbers are kept as they are",
                                file.pixels.photometric == "MONOCHROME1" ? "MONOCHROME1"
                                                                         : "PresentationLUTShape INVERSE"));
}

std::string why_not(DcmDataset& dataset, const DicomFile& file) {
  const DicomPixels& pixels = file.pixels;
  const TransferSyntax syntax = transfer_syntax(pixels.syntax);
  if (syntax.use == SyntaxUse::unknown)
    return fmt::format("has samples in the transfer syntax {}, which is not known", pixels.syntax);
  if (syntax.use == SyntaxUse::refused)
    return fmt::format("has samples in {}, which is not supported", in_words(syntax, pixels.syntax));
  for (const DcmTagKey& tag : {DCM_FloatPixelData, DCM_DoubleFloatPixelData, DCM_PixelDataProviderURL})
    if (dataset.tagExists(tag))
      return fmt::format("has its samples in {}, which is not supported", name_of(tag));
  if (integer_in(dataset, DCM_SamplesPerPixel).value_or(1) != 1 || pixels.photometric == "PALETTE COLOR")
    return fmt::format("has colors ({}), not one value a sample", pixels.photometric);
  if (pixels.allocated != 8 && pixels.allocated != 16 && pixels.allocated != 32)
    return fmt::format("has samples of {} bits, which are not supported", pixels.allocated);
  if (is_dose(dataset) && file.frames.front().rescale.slope == 0)
    return fmt::format("has doses without a scale (DoseGridScaling){}, so what its samples mean is not known",
                       dataset.tagExists(DCM_DoseGridScaling)
                           ? ", which is " + quoted(std::string_view(*text_of(dataset, DCM_DoseGridScaling)))
                           : "");
  const std::int64_t high = integer_in(dataset, DCM_HighBit).value_or(pixels.stored - 1);
  if (pixels.stored < 1 || pixels.stored > pixels.allocated || high != pixels.stored - 1)
    return fmt::format(
        "has samples of {} of {} bits, the highest of which is number {}; that is not supported",
        pixels.stored, pixels.allocated, high);
  return "";
}

}  // namespace

void read_pixel_facts(DcmDataset& dataset, const std::string& syntax, DicomFile& file) {
  DicomPixels& pixels = file.pixels;
  constexpr std::int64_t most_samples = 1 << 30;  // along an axis
  pixels.columns = integer_in(dataset, DCM_Columns).value_or(0);
  pixels.rows = integer_in(dataset, DCM_Rows).value_or(0);
  if (pixels.columns < 1 || pixels.rows < 1 || pixels.columns > most_samples || pixels.rows > most_samples)
    throw BrokenInput(fmt::format("has {} x {} samples", pixels.columns, pixels.rows));
  const auto bits = [](std::int64_t number) {
    return static_cast<int>(std::clamp<std::int64_t>(number, 0, 128));
  };
  pixels.allocated = bits(integer_in(dataset, DCM_BitsAllocated).value_or(0));
  pixels.stored = bits(required(dataset, DCM_BitsStored, pixels.allocated, file));
  const std::int64_t sign = required(dataset, DCM_PixelRepresentation, 0, file);
  if (sign != 0 && sign != 1)
    throw BrokenInput(
        fmt::format("PixelRepresentation is {}, which means neither with nor without a sign", sign));
  pixels.is_signed = sign == 1;
  pixels.photometric = text_of(dataset, DCM_PhotometricInterpretation).value_or("");
  if (pixels.photometric.empty()) pixels.photometric = "MONOCHROME2";
  pixels.syntax = syntax;
  pixels.syntax_name = transfer_syntax(syntax).name;
  pixels.big_endian = syntax == UID_BigEndianExplicitTransferSyntax;
  note_what_samples_mean(dataset, file);
}

void require_readable(DcmDataset& dataset, DicomFile& file) {
  file.pixels.unsupported = why_not(dataset, file);
}

std::string lossy_compression(DcmDataset& dataset, const DicomFile& file) {
  const std::string said = text_of(dataset, DCM_LossyImageCompression).value_or("");
  const std::string& syntax = file.pixels.syntax;
  bool is_lossy =
      said == "01" || syntax == UID_JPEGProcess1TransferSyntax || syntax == UID_JPEGProcess2_4TransferSyntax;
  if (!is_lossy && file.pixels.encapsulated) {
    // These syntaxes may hold images without a loss, too.
    const bool may_be =
        said != "00" && (syntax == UID_JPEGLSLossyTransferSyntax || syntax == UID_JPEG2000TransferSyntax);
    is_lossy = has_lossy_stream(file.path, file.pixels).value_or(may_be);
  }
  if (!is_lossy) return "";
  const std::string method = text_of(dataset, DCM_LossyImageCompressionMethod).value_or("");
  return method.empty() ? "DICOM" : "DICOM, " + method;
}

}  // namespace tagrid
