#include "io/formats/dicom/reader/dicom_file.h"

#include <dcmtk/config/osconfig.h>
// The configuration comes first.
#include <dcmtk/dcmdata/dcistrmf.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "io/files/file_bytes.h"
#include "io/formats/dicom/reader/attributes.h"
#include "io/formats/dicom/reader/data_set.h"
#include "io/formats/dicom/reader/pixel_element.h"
#include "io/formats/dicom/reader/transfer_syntax.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Longer values stay in the file; pixels do, above all.
constexpr Uint32 longest_value = 65536;
/// Longer texts are not kept as key-value pairs.
constexpr std::size_t longest_text = 1024;

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
    if (tag.isPrivate()) continue;
    if (std::string text = text_of(*element); !text.empty()) texts.emplace(name, std::move(text));
  }
  // Other fields report them.
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

/// The UID of the transfer syntax: the one that the file gives, otherwise the one that its bytes look like.
std::string syntax_of(DcmFileFormat& format, DicomFile& file) {
  if (auto given = text_of(*format.getMetaInfo(), DCM_TransferSyntaxUID); given && !given->empty())
    return *given;
  const DcmXfer found(format.getDataset()->getOriginalXfer());
  if (!format.getMetaInfo()->isEmpty())
    file.notes.miss("TransferSyntaxUID", fmt::format("it does not give its transfer syntax; it is read as {}",
                                                     found.getXferName()));
  return found.getXferID();
}

/// More frames cannot be in the file: a frame has at least a byte, or the head of a fragment.
std::uint64_t most_frames(const std::string& path, const DicomFile& file) {
  constexpr std::uint64_t most = std::uint64_t{1} << 31;
  return transfer_syntax(file.pixels.syntax).use == SyntaxUse::deflated
             ? most
             : std::min(most, FileSource(path).size());
}

void read_concatenation(DcmDataset& dataset, DicomFile& file) {
  file.concatenation = text_of(dataset, DCM_ConcatenationUID).value_or("");
  if (!file.concatenation.empty())
    file.concatenated = integer_in(dataset, DCM_InConcatenationTotalNumber).value_or(0);
}

/// Finds the places of samples, if possible. `offset` is the byte after the head of the pixels; in a deflated
/// file, it counts inflated bytes.
void find_samples(const DcmXfer& found, std::uint64_t offset, DicomFile& file) {
  DicomPixels& pixels = file.pixels;
  if (!pixels.unsupported.empty()) return;
  const TransferSyntax syntax = transfer_syntax(pixels.syntax);
  if (syntax.use == SyntaxUse::deflated) {
    pixels.inflated = offset;
    return;
  }
  try {
    const FileSource bytes(file.path);
    const auto length = pixel_length(bytes, offset, found.isExplicitVR(), pixels.big_endian);
    if (!length && syntax.has_fragments()) {
      if (syntax.use == SyntaxUse::plain_fragments) return find_plain_fragments(file, bytes, offset);
      pixels.encapsulated = offset;
      return check_streams(file, bytes, offset);
    }
    if (length.has_value() == syntax.has_fragments()) {
      pixels.unsupported =
          fmt::format("has samples {} fragments, which is not possible in its transfer syntax, {}",
                      length ? "without" : "in", in_words(syntax, pixels.syntax));
      return;
    }
    check_native_pixels(file, bytes, *length, offset);
    // Bytes in words of another byte order are swapped in pairs; the library puts them right.
    if (pixels.big_endian && pixels.allocated == 8) return;
    pixels.offset = offset;
    pixels.step = pixels.frame_bytes();
  } catch (const BrokenInput& error) {
    pixels.unsupported = error.what();  // another series in the directory may be intact
    pixels.is_cut = true;
  }
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
  file.is_mr = text_of(dataset, DCM_Modality) == "MR";
  if (const auto values = values_of(image_type); values.size() > 2) file.image_type = values[2];
  read_pixel_facts(dataset, syntax_of(format, file), file);
  read_frames(dataset, most_frames(path, file), file);
  read_concatenation(dataset, file);
  file.pixels.unsupported = why_not_readable(dataset, file);
  find_samples(DcmXfer(dataset.getOriginalXfer()), offset, file);
  file.pixels.lossy = lossy_compression(dataset, file);
  note_stream_without_sign(file);
  file.texts = texts_of(dataset);
  return file;
}

}  // namespace

std::optional<DicomFile> read_dicom_file(const std::string& path) {
  std::string series;
  try {
    return read(path, series);
  } catch (const BrokenInput& error) {
    throw BrokenDicomFile(path, error.what(), series);
  }
}

bool is_name_of_dicomdir(std::string_view name) {
  return lower_case(fs::path(name).stem().string()) == "dicomdir";
}

std::optional<std::vector<std::string>> files_of_dicomdir(const std::string& path) {
  if (!has_magic(beginning_of(path))) return std::nullopt;
  DcmFileFormat format;
  const OFCondition result = format.loadFileUntilTag(path.c_str(), EXS_Unknown, EGL_noChange, longest_value,
                                                     ERM_autoDetect, DCM_PixelData);
  const auto type = text_of(*format.getMetaInfo(), DCM_MediaStorageSOPClassUID);
  if (!type || *type != UID_MediaStorageDirectoryStorage) return std::nullopt;
  if (result.bad()) throw BrokenInput(fmt::format("{}: DICOM directory: {}", path, result.text()));
  if (!is_name_of_dicomdir(fs::path(path).filename().string()))
    throw BrokenInput(
        fmt::format("{}: is a DICOM directory with another name, so the files that it names are not read; "
                    "rename it to DICOMDIR",
                    path));
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
      // A directory is untrusted input: it names files below its directory, and no others.
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
