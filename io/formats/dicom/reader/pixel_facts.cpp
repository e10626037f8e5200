#include "io/formats/dicom/reader/data_set.h"

#include <fmt/format.h>

#include "io/errors/errors.h"
#include "io/formats/dicom/reader/pixel_element.h"
#include "io/formats/dicom/reader/transfer_syntax.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr const char* as_stored = "samples are kept as they are stored";

/// Notes a number that cannot be read, or that is 0 where it must not be.
bool is_doubtful(const ForeignNumber& number, const DcmTagKey& tag, bool may_be_zero, DicomNotes& notes) {
  if (number.is_unreadable())
    notes.doubt(name_of(tag), remark_on(number, name_of(tag), as_stored));
  else if (number.is_number() && number.value == 0 && !may_be_zero)
    notes.doubt(name_of(tag),
                fmt::format("{} is 0, which would make all values equal; {}", name_of(tag), as_stored));
  else
    return false;
  return true;
}

void note_missing(const DcmTagKey& tag, const DcmTagKey& other, double taken_as, DicomNotes& notes) {
  notes.miss(name_of(tag), fmt::format("{} is absent although there is a {}; it is taken as {}", name_of(tag),
                                       name_of(other), taken_as));
}

/// A number that every image must have; `otherwise` and a note if it is absent.
std::int64_t required(DcmDataset& dataset, const DcmTagKey& tag, std::int64_t otherwise, DicomFile& file) {
  const auto number = integer_in(dataset, tag);
  if (!number)
    file.notes.miss(name_of(tag), fmt::format("{} is {}; it is taken as {}", name_of(tag),
                                              dataset.tagExists(tag) ? "empty" : "absent", otherwise));
  return number.value_or(otherwise);
}

/// Overlays that lie in bits of the pixels, as older files have them (DICOM PS3.3, C.9.2, retired).
void note_overlays(DcmDataset& dataset, DicomFile& file) {
  for (Uint16 group = 0x6000; group <= 0x601E; group = static_cast<Uint16>(group + 2))
    if (integer_in(dataset, DcmTagKey(group, 0x0100)).value_or(1) > 1 &&
        !dataset.tagExists(DcmTagKey(group, 0x3000)))
      file.notes.miss(
          "OverlayBitPosition",
          "it has an overlay in bits of its pixels (OverlayBitPosition); only the samples are kept");
}

/// Attributes that say that samples are not plain numbers, or not only.
void note_what_samples_mean(DcmDataset& dataset, DicomFile& file) {
  note_tables(dataset, file.notes);
  note_overlays(dataset, file);
  if (text_of(dataset, DCM_ImageType).value_or("").find("MOSAIC") != std::string::npos)
    file.notes.miss(
        "ImageType",
        "its images are mosaics of several slices (ImageType MOSAIC); each is read as one slice, so that "
        "its place is not that of its parts");
  if (text_of(dataset, DCM_SegmentationType).value_or("") == "FRACTIONAL")
    file.notes.miss(
        "SegmentationType",
        "its samples are fractions of MaximumFractionalValue (SegmentationType FRACTIONAL); numbers are "
        "kept as they are");
  const std::string presentation = text_of(dataset, DCM_PixelPresentation).value_or("MONOCHROME");
  const bool has_palette = dataset.tagExists(DCM_RedPaletteColorLookupTableDescriptor);
  if (presentation.ends_with("COLOR") || presentation.ends_with("MIXED") || has_palette)
    file.notes.miss("PixelPresentation",
                    "some of its samples are numbers of colors (a supplemental palette), and no values");
  if (file.pixels.photometric == "MONOCHROME1" ||
      text_of(dataset, DCM_PresentationLUTShape).value_or("") == "INVERSE")
    file.notes.warn("PhotometricInterpretation",
                    fmt::format("small numbers mean white in these images ({}); numbers are kept as they are",
                                file.pixels.photometric == "MONOCHROME1" ? "MONOCHROME1"
                                                                         : "PresentationLUTShape INVERSE"));
}

}  // namespace

void read_rescale(DcmItem& item, Rescale& rescale, DicomNotes& notes) {
  if (auto type = text_of(item, DCM_RescaleType); type && *type != "US") rescale.units = *type;
  const ForeignNumber slope = number_in(item, DCM_RescaleSlope);
  const ForeignNumber intercept = number_in(item, DCM_RescaleIntercept);
  if (slope.is_absent() && intercept.is_absent()) return;
  const bool has_doubt = static_cast<int>(is_doubtful(slope, DCM_RescaleSlope, false, notes)) +
                             static_cast<int>(is_doubtful(intercept, DCM_RescaleIntercept, true, notes)) >
                         0;
  if (has_doubt) {
    rescale = {};
    return;
  }
  remark(slope, DCM_RescaleSlope, "", notes);
  remark(intercept, DCM_RescaleIntercept, "", notes);
  if (slope.is_absent()) note_missing(DCM_RescaleSlope, DCM_RescaleIntercept, rescale.slope, notes);
  if (intercept.is_absent()) note_missing(DCM_RescaleIntercept, DCM_RescaleSlope, rescale.intercept, notes);
  rescale.slope = slope.value_or(rescale.slope);
  rescale.intercept = intercept.value_or(rescale.intercept);
}

Rescale rescale_of_dose(DcmDataset& dataset, DicomNotes& notes) {
  std::string units = text_of(dataset, DCM_DoseUnits).value_or("");
  if (units == "GY") units = "Gy";
  const ForeignNumber scale = number_in(dataset, DCM_DoseGridScaling);
  remark(scale, DCM_DoseGridScaling, "doses have no scale", notes);
  return {scale.value_or(0), 0, lower_case(units) == "relative" ? "" : units};
}

void note_tables(DcmItem& dataset, DicomNotes& notes) {
  if (item_in(dataset, DCM_ModalityLUTSequence) != nullptr)
    notes.doubt(
        name_of(DCM_ModalityLUTSequence),
        fmt::format("values follow from samples by a table (ModalityLUTSequence), which is not applied; {}",
                    as_stored));
}

void note_real_world_values(DcmItem& item, const Rescale& rescale, DicomNotes& notes) {
  DcmItem* map = item_in(item, DCM_RealWorldValueMappingSequence);
  if (map == nullptr) return;
  if (map->tagExists(DCM_RealWorldValueLUTData)) {
    notes.miss("RealWorldValueLUTData",
               "it has a table of real world values (RealWorldValueLUTData), which is not applied");
    return;
  }
  const ForeignNumber slope = number_in(*map, DCM_RealWorldValueSlope);
  const ForeignNumber intercept = number_in(*map, DCM_RealWorldValueIntercept);
  if (slope.value_or(1) == rescale.slope && intercept.value_or(0) == rescale.intercept) return;
  notes.miss(
      "RealWorldValueMappingSequence",
      fmt::format("its real world values are {} * sample + {} (RealWorldValueMappingSequence), which is not "
                  "applied: values are {} * sample + {}",
                  slope.text, intercept.text, rescale.slope, rescale.intercept));
}

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

std::string why_not_readable(DcmDataset& dataset, const DicomFile& file) {
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
    return fmt::format(
        "has doses without a scale (DoseGridScaling){}, so what its samples mean is not known",
        dataset.tagExists(DCM_DoseGridScaling)
            ? ", which is " + tagrid::quoted(std::string_view(*text_of(dataset, DCM_DoseGridScaling)))
            : "");
  const std::int64_t high = integer_in(dataset, DCM_HighBit).value_or(pixels.stored - 1);
  if (pixels.stored < 1 || pixels.stored > pixels.allocated || high != pixels.stored - 1)
    return fmt::format(
        "has samples of {} of {} bits, the highest of which is number {}; that is not supported",
        pixels.stored, pixels.allocated, high);
  return "";
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
