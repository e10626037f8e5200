#include "tools/readers/dicom/dicom_file.h"

#include <dcmtk/config/osconfig.h>
// The configuration comes first.
#include <dcmtk/dcmdata/dcistrmf.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "io/files/errors.h"
#include "io/files/system_call.h"
#include "io/files/text.h"
#include "tools/readers/dicom/code_stream.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Longer values stay in the file; pixels do, above all.
constexpr Uint32 longest_value = 65536;
/// Longer texts are not kept as key-value pairs.
constexpr std::size_t longest_text = 1024;

std::optional<std::string> text_of(DcmItem& item, const DcmTagKey& tag) {
  OFString text;
  if (item.findAndGetOFStringArray(tag, text).bad()) return std::nullopt;
  std::string trimmed(text.c_str(), text.size());
  trimmed.erase(trimmed.find_last_not_of(" \0") + 1);
  return trimmed;
}

std::vector<std::string_view> values_of(std::string_view text) {
  std::vector<std::string_view> values;
  for (;;) {
    const std::size_t end = std::min(text.find('\\'), text.size());
    values.push_back(text.substr(0, end));
    if (end == text.size()) return values;
    text.remove_prefix(end + 1);
  }
}

/// Decimal numbers; nothing if there are not `n` finite ones.
template <std::size_t n>
std::optional<std::array<double, n>> numbers_of(DcmItem& item, const DcmTagKey& tag) {
  const auto text = text_of(item, tag);
  if (!text) return std::nullopt;
  const auto values = values_of(*text);
  if (values.size() != n) return std::nullopt;
  std::array<double, n> numbers;
  for (std::size_t i = 0; i < n; ++i) {
    const auto words = words_of(values[i]);
    const auto number = words.size() == 1 ? number_of(words[0]) : std::nullopt;
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers[i] = *number;
  }
  return numbers;
}

double number_in(DcmItem& item, const DcmTagKey& tag, double otherwise) {
  const auto number = numbers_of<1>(item, tag);
  return number ? (*number)[0] : otherwise;
}

std::int64_t integer_in(DcmItem& item, const DcmTagKey& tag, std::int64_t otherwise) {
  const double number = number_in(item, tag, static_cast<double>(otherwise));
  return std::abs(number) < 1e15 ? static_cast<std::int64_t>(number) : otherwise;
}

/// The first item of a sequence; nullptr if there is none.
DcmItem* item_in(DcmItem& item, const DcmTagKey& tag) {
  DcmItem* found = nullptr;
  return item.findAndGetSequenceItem(tag, found, 0).good() ? found : nullptr;
}

/// Changes `frame` as far as the item says something about it. The attributes of an enhanced image are in sequences, those
/// of others in the data set itself.
void read_frame(DcmItem& item, DicomFrame& frame) {
  if (const auto position = numbers_of<3>(item, DCM_ImagePositionPatient)) frame.position = *position;
  if (const auto o = numbers_of<6>(item, DCM_ImageOrientationPatient))
    frame.orientation = {{{(*o)[0], (*o)[1], (*o)[2]}, {(*o)[3], (*o)[4], (*o)[5]}}};
  // The distance between rows comes first.
  if (const auto spacing = numbers_of<2>(item, DCM_PixelSpacing))
    frame.spacing = {{(*spacing)[1], (*spacing)[0]}};
  const double thickness = number_in(item, DCM_SliceThickness, frame.thickness);
  frame.thickness = std::abs(number_in(item, DCM_SpacingBetweenSlices, thickness));
  frame.step = number_in(item, DCM_SpacingBetweenSlices, frame.step);
  frame.rescale.slope = number_in(item, DCM_RescaleSlope, frame.rescale.slope);
  frame.rescale.intercept = number_in(item, DCM_RescaleIntercept, frame.rescale.intercept);
  if (frame.rescale.slope == 0) frame.rescale = {};  // it would mean that all values are equal
  if (auto type = text_of(item, DCM_RescaleType); type && *type != "US") frame.rescale.units = *type;
  const std::array moments = {DCM_TemporalPositionIdentifier, DCM_EchoNumbers, DCM_AcquisitionNumber};
  for (std::size_t i = 0; i < moments.size(); ++i)
    frame.moments[i] = integer_in(item, moments[i], frame.moments[i]);
  frame.moments[0] = integer_in(item, DCM_TemporalPositionIndex, frame.moments[0]);
  frame.number = integer_in(item, DCM_InstanceNumber, frame.number);
  frame.number = integer_in(item, DCM_InStackPositionNumber, frame.number);
}

void read_functional_groups(DcmItem& groups, DicomFrame& frame) {
  for (const DcmTagKey& tag :
       {DCM_PlanePositionSequence, DCM_PlaneOrientationSequence, DCM_PixelMeasuresSequence,
        DCM_PixelValueTransformationSequence, DCM_FrameContentSequence, DCM_MREchoSequence})
    if (DcmItem* group = item_in(groups, tag)) read_frame(*group, frame);
}

std::vector<DicomFrame> frames_of(DcmDataset& dataset) {
  DicomFrame common;
  read_frame(dataset, common);
  if (DcmItem* shared = item_in(dataset, DCM_SharedFunctionalGroupsSequence))
    read_functional_groups(*shared, common);
  const std::int64_t count = std::max<std::int64_t>(integer_in(dataset, DCM_NumberOfFrames, 1), 1);
  // A frame has at least a byte; more cannot be in a file.
  if (count > std::int64_t{1} << 31) throw BrokenInput(fmt::format("has {} frames, which cannot be", count));
  DcmSequenceOfItems* groups = nullptr;
  dataset.findAndGetSequence(DCM_PerFrameFunctionalGroupsSequence, groups);
  if (groups != nullptr && static_cast<std::int64_t>(groups->card()) != count)
    throw BrokenInput(fmt::format("has {} frames, but describes {} of them", count, groups->card()));
  if (groups == nullptr && count > std::int64_t{1} << 20)
    throw BrokenInput(fmt::format("has {} frames without their places", count));
  std::vector<DicomFrame> frames(static_cast<std::size_t>(count), common);
  if (groups != nullptr) {
    DcmObject* item = nullptr;
    for (DicomFrame& frame : frames) {
      item = groups->nextInContainer(item);
      read_functional_groups(dynamic_cast<DcmItem&>(*item), frame);
    }
    return frames;
  }
  if (count == 1) return frames;
  // Frames without places of their own lie behind each other; the distances may be given (dose).
  std::vector<double> offsets;
  if (const auto text = text_of(dataset, DCM_GridFrameOffsetVector))
    for (const std::string_view value : values_of(*text)) offsets.push_back(number_of(value).value_or(NAN));
  // Offsets that do not begin with 0 are coordinates along z, of images at right angles to it.
  if (!offsets.empty() && offsets[0] != 0 && common.orientation) {
    const double z = normal_of(common)[2];
    for (double& offset : offsets) offset *= std::abs(z) > 0.999 ? std::copysign(1, z) : NAN;
  }
  // The sign says in which direction they follow each other.
  const double step = common.step != 0 ? common.step : common.thickness;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].number = static_cast<std::int64_t>(i) + 1;
    const double along =
        offsets.size() == frames.size() ? offsets[i] - offsets[0] : step * static_cast<double>(i);
    if (!common.position || !common.orientation || !std::isfinite(along) ||
        (common.thickness == 0 && offsets.empty())) {
      frames[i].position.reset();
      continue;
    }
    const Vector3 normal = normal_of(common);
    for (std::size_t axis = 0; axis < 3; ++axis) (*frames[i].position)[axis] += along * normal[axis];
  }
  return frames;
}

/// Checks the header of the pixels in front of `offset`, and that the file has all of them.
void require_plain_pixels(const DicomFile& file, bool is_explicit, std::uint64_t offset) {
  std::ifstream stream(file.path, std::ios::binary);
  std::array<unsigned char, 12> head = {};
  const std::uint64_t bytes = is_explicit ? 12 : 8;
  if (offset < bytes) throw BrokenInput("its pixels have no header");
  stream.seekg(static_cast<std::streamoff>(offset - bytes));
  stream.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(bytes));
  const auto number = [&](std::size_t at, std::size_t count) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i)
      value = value << 8 | head[file.pixels.big_endian ? at + i : at + count - 1 - i];
    return value;
  };
  const std::uint64_t length = number(bytes - 4, 4);
  if (!stream || number(0, 2) != 0x7fe0 || number(2, 2) != 0x0010)
    throw BrokenInput("its pixels cannot be found");
  const std::uint64_t frames = file.frames.size(), wanted = frames * file.pixels.frame_bytes();
  if (length < wanted)
    throw BrokenInput(
        fmt::format("its pixels have {} bytes, but {} x {} samples of {} bits in {} frame{} have {}", length,
                    file.pixels.columns, file.pixels.rows, file.pixels.allocated, frames,
                    frames == 1 ? "" : "s", wanted));
  const auto status = status_of(file.path);
  if (!status || static_cast<std::uint64_t>(status->st_size) < offset + wanted)
    throw BrokenInput(
        fmt::format("ends too soon, within its pixels: {} bytes are missing",
                    offset + wanted - (status ? static_cast<std::uint64_t>(status->st_size) : 0)));
}

bool is_dose(DcmDataset& dataset) {
  return text_of(dataset, DCM_SOPClassUID).value_or("") == UID_RTDoseStorage;
}

/// The dose that one is.
Rescale rescale_of_dose(DcmDataset& dataset) {
  std::string units = text_of(dataset, DCM_DoseUnits).value_or("");
  if (units == "GY") units = "Gy";
  return {number_in(dataset, DCM_DoseGridScaling, 1), 0, lower_case(units) == "relative" ? "" : units};
}

std::string unsupported(DcmDataset& dataset, const DicomPixels& pixels, const DcmXfer& syntax) {
  if (integer_in(dataset, DCM_SamplesPerPixel, 1) != 1 || pixels.photometric == "PALETTE COLOR")
    return fmt::format("has colors ({}), not one value a sample", pixels.photometric);
  if (pixels.allocated != 8 && pixels.allocated != 16 && pixels.allocated != 32)
    return fmt::format("has samples of {} bits, which are not supported", pixels.allocated);
  if (is_dose(dataset) && number_in(dataset, DCM_DoseGridScaling, 0) == 0)
    return "has doses without a scale (DoseGridScaling), so what its samples mean is not known";
  const std::int64_t high = integer_in(dataset, DCM_HighBit, pixels.stored - 1);
  if (pixels.stored < 1 || pixels.stored > pixels.allocated || high != pixels.stored - 1)
    return fmt::format(
        "has samples of {} of {} bits, the highest of which is number {}; that is not supported",
        pixels.stored, pixels.allocated, high);
  switch (syntax.getXfer()) {
    case EXS_LittleEndianImplicit:
    case EXS_LittleEndianExplicit:
    case EXS_BigEndianExplicit:
    case EXS_DeflatedLittleEndianExplicit:
    case EXS_JPEGProcess1:
    case EXS_JPEGProcess2_4:
    case EXS_JPEGProcess14:
    case EXS_JPEGProcess14SV1:
    case EXS_JPEGLSLossless:
    case EXS_JPEGLSLossy:
    case EXS_JPEG2000LosslessOnly:
    case EXS_JPEG2000:
    case EXS_RLELossless:
      return "";
    default:
      return fmt::format("has samples in {}, which is not supported", syntax.getXferName());
  }
}

/// What DicomPixels::lossy is. It does not name the syntax, so that it is the same of a file that was decoded.
std::string lossy_compression(DcmDataset& dataset, const DicomFile& file, E_TransferSyntax syntax) {
  const std::string said = text_of(dataset, DCM_LossyImageCompression).value_or("");
  bool is_lossy = said == "01" || syntax == EXS_JPEGProcess1 || syntax == EXS_JPEGProcess2_4;
  if (!is_lossy && file.pixels.encapsulated) {
    // These syntaxes may hold images without a loss, too.
    const bool may_be = said != "00" && (syntax == EXS_JPEGLSLossy || syntax == EXS_JPEG2000);
    is_lossy = has_lossy_stream(file.path, file.pixels).value_or(may_be);
  }
  if (!is_lossy) return "";
  const std::string method = text_of(dataset, DCM_LossyImageCompressionMethod).value_or("");
  return method.empty() ? "DICOM" : "DICOM, " + method;
}

/// Attributes of the data set itself that are texts or numbers, by their names.
std::map<std::string, std::string> texts_of(DcmDataset& dataset) {
  // Where letters are known, they become UTF-8; otherwise they stay as they are.
  dataset.convertToUTF8();
  std::map<std::string, std::string> texts;
  for (DcmObject* object = dataset.nextInContainer(nullptr); object != nullptr;
       object = dataset.nextInContainer(object)) {
    auto* element = dynamic_cast<DcmElement*>(object);
    if (element == nullptr || !element->isLeaf() || element->getLengthField() > longest_text) continue;
    switch (element->ident()) {
      case EVR_OB:
      case EVR_OW:
      case EVR_OF:
      case EVR_OD:
      case EVR_OL:
      case EVR_UN:
        continue;
      default:
        break;
    }
    DcmTag tag = element->getTag();
    const char* name = tag.getTagName();
    OFString value;
    if (tag.isPrivate() || element->getOFStringArray(value).bad() || value.empty()) continue;
    std::string text(value.c_str(), value.size());
    text.erase(text.find_last_not_of(" \0") + 1);
    if (!text.empty()) texts.emplace(name, std::move(text));
  }
  // They are told in other ways.
  for (const char* name :
       {"SamplesPerPixel", "Rows", "Columns", "BitsAllocated", "BitsStored", "HighBit", "PixelRepresentation",
        "RescaleSlope", "RescaleIntercept", "RescaleType", "PixelSpacing", "ImagePositionPatient",
        "ImageOrientationPatient", "NumberOfFrames", "InstanceNumber", "SOPInstanceUID",
        "SpecificCharacterSet", "SliceLocation"})
    texts.erase(name);
  return texts;
}

/// As many bytes as tell a DICOM file from others.
std::string beginning_of(const std::string& path) {
  std::string beginning(132, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file) throw world_error("cannot open", path, errno);
  file.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(file.gcount()));
  return beginning;
}

bool has_magic(std::string_view beginning) { return beginning.size() == 132 && beginning.ends_with("DICM"); }

/// True if a file without the magic may be a data set: it begins with an attribute of group 2 or 8.
bool may_be_dataset(std::string_view beginning) {
  const auto byte = [&](std::size_t i) { return i < beginning.size() ? beginning[i] : '\0'; };
  return (byte(0) == 0 && (byte(1) == 2 || byte(1) == 8)) || (byte(1) == 0 && (byte(0) == 2 || byte(0) == 8));
}

/// True if a data set should have an image: it says so, or says nothing.
bool should_have_image(DcmFileFormat& format) {
  auto uid = text_of(*format.getDataset(), DCM_SOPClassUID);
  if (!uid) uid = text_of(*format.getMetaInfo(), DCM_MediaStorageSOPClassUID);
  if (!uid) return true;
  const char* name = dcmFindNameOfUID(uid->c_str());
  return *uid == UID_RTDoseStorage ||
         (name != nullptr && std::string_view(name).find("ImageStorage") != std::string_view::npos);
}

std::string in_words(const OFCondition& failure) {
  if (failure == EC_StreamNotifyClient || failure == EC_EndOfStream) return "ends too soon";
  if (failure == EC_InvalidStream) return "ends too soon, or is damaged";
  return failure.text();
}

/// `series` receives the UID as soon as it is known.
std::optional<DicomFile> read(const std::string& path, std::string& series) {
  const std::string beginning = beginning_of(path);
  const bool is_sure = has_magic(beginning);
  if (!is_sure && !may_be_dataset(beginning)) return std::nullopt;
  DcmInputFileStream stream(path.c_str());
  DcmFileFormat format;
  format.transferInit();
  const OFCondition result =
      format.readUntilTag(stream, EXS_Unknown, EGL_noChange, longest_value, DCM_PixelData);
  format.transferEnd();
  DcmDataset& dataset = *format.getDataset();
  const bool has_size = dataset.tagExists(DCM_Rows) && dataset.tagExists(DCM_Columns);
  if (!is_sure && (result.bad() || !dataset.tagExists(DCM_SOPClassUID))) return std::nullopt;
  series = text_of(dataset, DCM_SeriesInstanceUID).value_or("");
  if (result.bad()) throw BrokenInput(in_words(result));
  DicomFile file;
  file.path = path;
  file.series = series;
  if (!has_size) {
    if (should_have_image(format)) throw BrokenInput("ends too soon, before its image");
    return file;
  }
  const auto offset = static_cast<std::uint64_t>(stream.tell());
  file.instance = text_of(dataset, DCM_SOPInstanceUID).value_or("");
  const std::string image_type = text_of(dataset, DCM_ImageType).value_or("");
  if (const auto values = values_of(image_type); values.size() > 2) file.image_type = values[2];
  DicomPixels& pixels = file.pixels;
  pixels.columns = integer_in(dataset, DCM_Columns, 0);
  pixels.rows = integer_in(dataset, DCM_Rows, 0);
  pixels.allocated =
      static_cast<int>(std::clamp<std::int64_t>(integer_in(dataset, DCM_BitsAllocated, 0), 0, 64));
  pixels.stored = static_cast<int>(
      std::clamp<std::int64_t>(integer_in(dataset, DCM_BitsStored, pixels.allocated), 0, 64));
  pixels.is_signed = integer_in(dataset, DCM_PixelRepresentation, 0) == 1;
  pixels.photometric = text_of(dataset, DCM_PhotometricInterpretation).value_or("MONOCHROME2");
  const DcmXfer syntax(dataset.getOriginalXfer());
  pixels.syntax = syntax.getXferID();
  pixels.syntax_name = syntax.getXferName();
  pixels.big_endian = syntax.getXfer() == EXS_BigEndianExplicit;
  pixels.unsupported = unsupported(dataset, pixels, syntax);
  if (pixels.columns < 1 || pixels.rows < 1)
    throw BrokenInput(fmt::format("has {} x {} samples", pixels.columns, pixels.rows));
  file.frames = frames_of(dataset);
  if (is_dose(dataset))
    for (DicomFrame& frame : file.frames) frame.rescale = rescale_of_dose(dataset);
  if (syntax.isEncapsulated()) pixels.encapsulated = offset;
  pixels.lossy = lossy_compression(dataset, file, syntax.getXfer());
  // The library counts the bytes that it inflates.
  if (syntax.getXfer() == EXS_DeflatedLittleEndianExplicit) pixels.inflated = offset;
  // Bytes in words of another byte order are swapped in pairs; the library puts them right.
  const bool is_plain = !syntax.isEncapsulated() && syntax.getStreamCompression() == ESC_none &&
                        !(pixels.big_endian && pixels.allocated == 8);
  if (is_plain && pixels.unsupported.empty()) {
    try {
      require_plain_pixels(file, syntax.isExplicitVR(), offset);
      pixels.offset = offset;
    } catch (const BrokenInput& error) {
      pixels.unsupported = error.what();  // another series of the folder may be whole
      pixels.is_cut = true;
    }
  }
  file.texts = texts_of(dataset);
  return file;
}

}  // namespace

Vector3 normal_of(const DicomFrame& frame) {
  const auto& [r, c] = *frame.orientation;
  return {r[1] * c[2] - r[2] * c[1], r[2] * c[0] - r[0] * c[2], r[0] * c[1] - r[1] * c[0]};
}

std::optional<DicomFile> read_dicom_file(const std::string& path) {
  std::string series;
  try {
    return read(path, series);
  } catch (const BrokenInput& error) {
    throw BrokenDicomFile(path, error.what(), series);
  }
}

std::optional<std::vector<std::string>> files_of_dicomdir(const std::string& path) {
  if (!has_magic(beginning_of(path))) return std::nullopt;
  DcmFileFormat format;
  const OFCondition result = format.loadFileUntilTag(path.c_str(), EXS_Unknown, EGL_noChange, longest_value,
                                                     ERM_autoDetect, DCM_PixelData);
  const auto type = text_of(*format.getMetaInfo(), DCM_MediaStorageSOPClassUID);
  if (!type || *type != UID_MediaStorageDirectoryStorage) return std::nullopt;
  if (result.bad()) throw BrokenInput(fmt::format("{}: DICOM directory: {}", path, result.text()));
  std::vector<std::string> files;
  DcmSequenceOfItems* records = nullptr;
  format.getDataset()->findAndGetSequence(DCM_DirectoryRecordSequence, records);
  for (DcmObject* object = nullptr; records != nullptr;) {
    object = records->nextInContainer(object);
    if (object == nullptr) break;
    auto* record = dynamic_cast<DcmItem*>(object);
    if (record == nullptr || text_of(*record, DCM_DirectoryRecordType).value_or("") != "IMAGE") continue;
    const auto name = text_of(*record, DCM_ReferencedFileID);
    if (!name) continue;
    fs::path file = fs::path(path).parent_path();
    for (const std::string_view part : values_of(*name)) {
      // A directory is untrusted input: it names files below its folder, and no others.
      if (part.empty() || part == ".." || part.find('/') != part.npos)
        throw BrokenInput(fmt::format("{}: DICOM directory: names the file {}, which is not below it", path,
                                      tagrid::quoted(std::string_view(*name))));
      file /= part;
    }
    files.push_back(file.string());
  }
  return files;
}

}  // namespace tagrid
