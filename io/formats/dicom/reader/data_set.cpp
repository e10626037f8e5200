#include "io/formats/dicom/reader/data_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
    throw BrokenInput("has {} x {} samples", pixels.columns, pixels.rows);
  const auto bits = [](std::int64_t number) {
    return static_cast<int>(std::clamp<std::int64_t>(number, 0, 128));
  };
  pixels.allocated = bits(integer_in(dataset, DCM_BitsAllocated).value_or(0));
  pixels.stored = bits(required(dataset, DCM_BitsStored, pixels.allocated, file));
  const std::int64_t sign = required(dataset, DCM_PixelRepresentation, 0, file);
  if (sign != 0 && sign != 1)
    throw BrokenInput("PixelRepresentation is {}, which means neither with nor without a sign", sign);
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

// Syntaxes that not all releases of the library have names for.
constexpr std::string_view jpeg_xl_of_jpeg = "1.2.840.10008.1.2.4.111", jpeg_xl = "1.2.840.10008.1.2.4.112",
                           ht_jpeg2000 = "1.2.840.10008.1.2.4.203";

std::string lossy_compression(DcmDataset& dataset, const DicomFile& file) {
  const std::string said = text_of(dataset, DCM_LossyImageCompression).value_or("");
  const std::string& syntax = file.pixels.syntax;
  bool is_lossy = said == "01" || syntax == UID_JPEGProcess1TransferSyntax ||
                  syntax == UID_JPEGProcess2_4TransferSyntax || syntax == jpeg_xl_of_jpeg;
  if (!is_lossy && file.pixels.encapsulated) {
    // These syntaxes may hold images without a loss, too.
    const bool may_be =
        said != "00" && (syntax == UID_JPEGLSLossyTransferSyntax || syntax == UID_JPEG2000TransferSyntax ||
                         syntax == ht_jpeg2000 || syntax == jpeg_xl);
    is_lossy = has_lossy_stream(file.path, file.pixels).value_or(may_be);
  }
  if (!is_lossy) return "";
  const std::string method = text_of(dataset, DCM_LossyImageCompressionMethod).value_or("");
  return method.empty() ? "DICOM" : "DICOM, " + method;
}

namespace {

constexpr const char* no_place = "it is not used, so the place of the image is not known";

/// Directions that are not at right angles, or not of length 1, by more than rounded texts are.
constexpr double crooked = 0.01;

bool is_orientation(const std::vector<double>& o) {
  const auto dot = [&](std::size_t a, std::size_t b) {
    return o[a] * o[b] + o[a + 1] * o[b + 1] + o[a + 2] * o[b + 2];
  };
  return std::abs(dot(0, 0) - 1) < crooked && std::abs(dot(3, 3) - 1) < crooked &&
         std::abs(dot(0, 3)) < crooked;
}

void read_place(DcmItem& item, DicomFrame& frame, DicomNotes& notes) {
  if (const auto p = numbers_in(item, DCM_ImagePositionPatient, 3, no_place, notes); p.are_numbers())
    frame.position = {p.values[0], p.values[1], p.values[2]};
  else if (p.are_there())
    frame.position.reset();
  const auto o = numbers_in(item, DCM_ImageOrientationPatient, 6, no_place, notes);
  if (o.are_numbers() && is_orientation(o.values)) {
    frame.orientation = {{{o.values[0], o.values[1], o.values[2]}, {o.values[3], o.values[4], o.values[5]}}};
  } else if (o.are_there()) {
    frame.orientation.reset();
    if (o.are_numbers())
      notes.warn(name_of(DCM_ImageOrientationPatient),
                 fmt::format("ImageOrientationPatient is {}, which are not two directions at right "
                             "angles; {}",
                             fmt::join(o.values, ", "), no_place));
  }
}

/// A distance that may be empty, which means that it is not known.
std::optional<double> distance_in(DcmItem& item, const DcmTagKey& tag, DicomNotes& notes) {
  const ForeignNumber number = number_in(item, tag);
  if (number.is_unreadable() && trimmed(number.text).empty()) return std::nullopt;
  remark(number, tag, "it is not used", notes);
  return number.is_number() ? std::optional(number.value) : std::nullopt;
}

void read_distances(DcmItem& item, DicomFrame& frame, DicomNotes& notes) {
  // The distance between rows comes first.
  const char* const unknown = "so the distances between samples are not known";
  const auto spacing = numbers_in(item, DCM_PixelSpacing, 2, unknown, notes);
  if (spacing.are_numbers() && spacing.values[0] > 0 && spacing.values[1] > 0) {
    frame.spacing = {{spacing.values[1], spacing.values[0]}};
  } else if (spacing.are_there()) {
    frame.spacing.reset();
    if (spacing.are_numbers())
      notes.warn(name_of(DCM_PixelSpacing), fmt::format("PixelSpacing is {}, which are not distances; {}",
                                                        fmt::join(spacing.values, ", "), unknown));
  }
  const double thickness = distance_in(item, DCM_SliceThickness, notes).value_or(frame.thickness);
  const auto step = distance_in(item, DCM_SpacingBetweenSlices, notes);
  frame.thickness = std::abs(step.value_or(thickness));
  frame.step = step.value_or(frame.step);
}

/// A number that orders images. Other texts give no order.
std::int64_t order_in(DcmItem& item, const DcmTagKey& tag, std::int64_t otherwise, DicomNotes& notes) {
  const ForeignNumber number = number_in(item, tag);
  if (number.is_unreadable() && trimmed(number.text).empty()) return otherwise;
  remark(number, tag, "it is not used", notes);
  return std::abs(number.value) < 1e15
             ? static_cast<std::int64_t>(number.value_or(static_cast<double>(otherwise)))
             : otherwise;
}

/// Changes `frame` as far as the item says something about it. The attributes of an enhanced image are in
/// sequences, those of others in the data set itself.
void read_frame(DcmItem& item, DicomFrame& frame, Moments& moments, DicomNotes& notes) {
  read_place(item, frame, notes);
  read_distances(item, frame, notes);
  read_rescale(item, frame.rescale, notes);
  read_moments(item, moments);
  frame.number = order_in(item, DCM_InstanceNumber, frame.number, notes);
  frame.number = order_in(item, DCM_InStackPositionNumber, frame.number, notes);
}

void read_functional_groups(DcmItem& groups, DicomFrame& frame, Moments& moments, DicomNotes& notes) {
  for (const DcmTagKey& tag :
       {DCM_PlanePositionSequence, DCM_PlaneOrientationSequence, DCM_PixelMeasuresSequence,
        DCM_PixelValueTransformationSequence, DCM_FrameContentSequence, DCM_MREchoSequence})
    if (DcmItem* group = item_in(groups, tag)) read_frame(*group, frame, moments, notes);
  for (const DcmTagKey& tag :
       {DCM_MRTimingAndRelatedParametersSequence, DCM_MRModifierSequence, DCM_MRDiffusionSequence,
        DCM_MRImageFrameTypeSequence, DCM_CTImageFrameTypeSequence, DCM_PETFrameTypeSequence,
        DCM_CardiacSynchronizationSequence, DCM_TemporalPositionSequence, DCM_SegmentIdentificationSequence})
    if (DcmItem* group = item_in(groups, tag)) {
      read_moments(*group, moments);
      if (DcmItem* directions = item_in(*group, DCM_DiffusionGradientDirectionSequence))
        read_moments(*directions, moments);
    }
  for (const DcmTagKey& tag :
       {DCM_RespiratorySynchronizationSequence, DCM_CTXRayDetailsSequence, DCM_CTReconstructionSequence,
        DCM_CTAcquisitionDetailsSequence, DCM_ContrastBolusUsageSequence})
    if (DcmItem* group = item_in(groups, tag)) read_moments(*group, moments, true);
  note_real_world_values(groups, frame.rescale, notes);
}

std::int64_t count_of_frames(DcmDataset& dataset, std::uint64_t most, DicomNotes& notes) {
  const auto given = integer_in(dataset, DCM_NumberOfFrames);
  if (!given && !dataset.tagExists(DCM_NumberOfFrames)) return 1;
  if (given.value_or(0) == 0) {
    notes.miss(name_of(DCM_NumberOfFrames),
               fmt::format("NumberOfFrames is {}; it is taken as 1", given ? "0" : "empty"));
    return 1;
  }
  if (*given < 0 || static_cast<std::uint64_t>(*given) > most)
    throw BrokenInput("has {} frames (NumberOfFrames), which cannot be in a file of its size", *given);
  return *given;
}

bool is_number_of_slice(double number) { return number == std::floor(number) && std::abs(number) < 1e9; }

/// How the frames of a data set without functional groups follow each other.
struct Succession {
  std::vector<double> slices;   ///< the number of the slice that each frame is, from 1 on (nuclear medicine)
  std::vector<double> offsets;  ///< along the normal, in mm (dose)
  bool is_in_space = true;
};

Succession succession_of(DcmDataset& dataset, std::size_t frames, const DicomFrame& common,
                         DicomNotes& notes) {
  Succession succession;
  DcmElement* element = nullptr;
  std::vector<std::string> others;
  bool has_slices = false;
  if (dataset.findAndGetElement(DCM_FrameIncrementPointer, element).good())
    for (unsigned long i = 0; i < std::min(element->getVM(), 16UL); ++i) {
      DcmTagKey tag;
      if (auto* pointer = dynamic_cast<DcmAttributeTag*>(element);
          pointer == nullptr || pointer->getTagVal(tag, i).bad())
        continue;
      if (tag == DCM_SliceVector)
        has_slices = true;
      else if (tag != DCM_GridFrameOffsetVector)
        others.push_back(name_of(tag));
    }
  const char* const unplaced = "the places of its frames are not known";
  if (has_slices) {
    const auto numbers = numbers_in(dataset, DCM_SliceVector, frames, unplaced, notes);
    succession.is_in_space = numbers.are_numbers() && std::ranges::all_of(numbers.values, is_number_of_slice);
    if (succession.is_in_space) succession.slices = numbers.values;
  } else if (!others.empty()) {
    succession.is_in_space = false;
    notes.warn(
        name_of(DCM_FrameIncrementPointer),
        fmt::format("its frames follow each other by {} (FrameIncrementPointer), not in space; they are "
                    "kept in their order, as slices without places",
                    fmt::join(others, ", ")));
  }
  const auto offsets = numbers_in(dataset, DCM_GridFrameOffsetVector, frames, unplaced, notes);
  if (!offsets.are_there()) return succession;
  succession.is_in_space = succession.is_in_space && offsets.are_numbers();
  succession.offsets = offsets.values;
  if (!offsets.are_numbers() || offsets.values[0] == 0) return succession;
  // Offsets that do not begin with 0 are coordinates along z, of images at right angles to it.
  const double z = common.orientation ? normal_of(common)[2] : 1;
  if (std::abs(z) <= 0.999) succession.is_in_space = false;
  for (double& offset : succession.offsets) offset *= std::copysign(1, z);
  return succession;
}

/// Gives places to frames without places of their own.
void place_frames(DcmDataset& dataset, const DicomFrame& common, DicomFile& file) {
  std::vector<DicomFrame>& frames = file.frames;
  const Succession succession = succession_of(dataset, frames.size(), common, file.notes);
  // The sign says in which direction they follow each other.
  const double step = common.step != 0 ? common.step : common.thickness;
  std::vector<Moments*> moments;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    DicomFrame& frame = frames[i];
    moments.push_back(&frame.moments);
    const double slice =
        succession.slices.size() == frames.size() ? succession.slices[i] - 1 : static_cast<double>(i);
    frame.number = static_cast<std::int64_t>(slice) + 1;
    const bool has_offsets = succession.offsets.size() == frames.size();
    const double along = has_offsets ? succession.offsets[i] - succession.offsets[0] : step * slice;
    if (!succession.is_in_space) frame.thickness = frame.step = 0;
    if (!common.position || !common.orientation || !succession.is_in_space || (step == 0 && !has_offsets)) {
      frame.position.reset();
      continue;
    }
    if (common.step == 0 && !has_offsets)
      file.notes.warn(
          name_of(DCM_SpacingBetweenSlices),
          fmt::format("the distance between its frames is not given; it is taken to be their thickness, "
                      "{} mm",
                      common.thickness));
    const Vector3 normal = normal_of(common);
    for (std::size_t axis = 0; axis < 3; ++axis) (*frame.position)[axis] += along * normal[axis];
  }
  read_vectors(dataset, moments);
}

}  // namespace

Vector3 unit_of(const Vector3& vector) {
  const double length = std::hypot(vector[0], vector[1], vector[2]);
  return {vector[0] / length, vector[1] / length, vector[2] / length};
}

Vector3 normal_of(const DicomFrame& frame) {
  const auto& [r, c] = *frame.orientation;
  return unit_of({r[1] * c[2] - r[2] * c[1], r[2] * c[0] - r[0] * c[2], r[0] * c[1] - r[1] * c[0]});
}

bool is_dose(DcmDataset& dataset) {
  return text_of(dataset, DCM_SOPClassUID).value_or("") == UID_RTDoseStorage;
}

void read_frames(DcmDataset& dataset, std::uint64_t most, DicomFile& file) {
  DicomFrame common;
  read_frame(dataset, common, file.moments, file.notes);
  note_real_world_values(dataset, common.rescale, file.notes);
  if (DcmItem* shared = item_in(dataset, DCM_SharedFunctionalGroupsSequence))
    read_functional_groups(*shared, common, file.moments, file.notes);
  const std::int64_t count = count_of_frames(dataset, most, file.notes);
  DcmSequenceOfItems* groups = nullptr;
  dataset.findAndGetSequence(DCM_PerFrameFunctionalGroupsSequence, groups);
  if (groups != nullptr && static_cast<std::int64_t>(groups->card()) != count)
    throw BrokenInput("has {} frames, but describes {} of them", count, groups->card());
  if (groups == nullptr && count > std::int64_t{1} << 20)
    throw BrokenInput("has {} frames without their places", count);
  file.frames.assign(static_cast<std::size_t>(count), common);
  if (groups != nullptr) {
    DcmObject* item = nullptr;
    for (DicomFrame& frame : file.frames) {
      item = groups->nextInContainer(item);
      read_functional_groups(dynamic_cast<DcmItem&>(*item), frame, frame.moments, file.notes);
    }
  } else if (count > 1) {
    place_frames(dataset, common, file);
  }
  if (!is_dose(dataset)) return;
  const Rescale rescale = rescale_of_dose(dataset, file.notes);
  for (DicomFrame& frame : file.frames) frame.rescale = rescale;
}

}  // namespace tagrid
