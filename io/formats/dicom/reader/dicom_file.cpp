#include "io/formats/dicom/reader/dicom_file.h"

// The configuration comes first.
#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <string_view>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/files/file_bytes.h"
#include "io/formats/dicom/reader/attributes.h"
#include "io/formats/dicom/reader/character_sets.h"
#include "io/formats/dicom/reader/data_set.h"
#include "io/formats/dicom/reader/header_stream.h"
#include "io/formats/dicom/reader/pixel_element.h"
#include "io/formats/dicom/reader/transfer_syntax.h"
#include "io/programs/stored_samples.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Longer values stay in the file; pixels do, above all.
constexpr Uint32 longest_value = 65536;
/// Longer texts are not kept as key-value pairs.
constexpr std::size_t longest_text = 1024;

/// Makes a text UTF-8. Of one for which that is not possible, other bytes than ASCII become U+FFFD and two hexadecimal
/// digits, with a note: as letters, they could be wrong ones.
void make_utf8(std::string& text, DcmEVR type, const char* name, const std::string& terms,
               DicomNotes& notes) {
  const bool is_one_text = type == EVR_ST || type == EVR_LT || type == EVR_UT;
  const char* delimiters = is_one_text ? "" : type == EVR_PN ? "\\^=" : "\\";
  if (auto in_utf8 = CharacterSets(terms).in_utf8(text, delimiters)) {
    text = std::move(*in_utf8);
    return;
  }
  std::string digits;
  for (const char byte : text)
    if ((byte & 0x80) == 0 && byte != '\x1B')
      digits += byte;
    else
      digits += fmt::format("\xEF\xBF\xBD{:02X}", static_cast<unsigned char>(byte));
  text = std::move(digits);
  const std::string set = terms.empty() ? "absent" : tagrid::quoted(std::string_view(terms));
  notes.warn(
      "SpecificCharacterSet",
      fmt::format("{} has bytes that are not letters of its character set (SpecificCharacterSet is {}); each "
                  "of them becomes U+FFFD and two hexadecimal digits",
                  name, set));
}

/// Attributes of the data set itself that are texts or numbers, by their names.
std::map<std::string, std::string> texts_of(DcmDataset& dataset, DicomNotes& notes) {
  const std::string terms = text_of(dataset, DCM_SpecificCharacterSet).value_or("");
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
    std::string text = text_of(*element);
    if (text.empty()) continue;
    make_utf8(text, element->ident(), name, terms, notes);
    texts.emplace(name, std::move(text));
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

void make_units_utf8(DcmDataset& dataset, DicomFile& file) {
  const std::string terms = text_of(dataset, DCM_SpecificCharacterSet).value_or("");
  for (DicomFrame& frame : file.frames)
    make_utf8(frame.rescale.units, EVR_LO, "RescaleType", terms, file.notes);
}

/// As many bytes as tell a DICOM file from others.
std::string beginning_of(const FileSource& file) {
  std::string beginning(std::min<std::size_t>(132, file.size()), '\0');
  file.read_at(0, std::as_writable_bytes(std::span(beginning)));
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
std::uint64_t most_frames(const FileSource& bytes, const DicomFile& file) {
  constexpr std::uint64_t most = std::uint64_t{1} << 31;
  return transfer_syntax(file.pixels.syntax).use == SyntaxUse::deflated ? most : std::min(most, bytes.size());
}

void read_concatenation(DcmDataset& dataset, DicomFile& file) {
  file.concatenation = text_of(dataset, DCM_ConcatenationUID).value_or("");
  if (!file.concatenation.empty())
    file.concatenated = integer_in(dataset, DCM_InConcatenationTotalNumber).value_or(0);
}

/// Finds the places of samples, if possible. `offset` is the byte after the head of the pixels; in a deflated
/// file, it counts inflated bytes.
void find_samples(const DcmXfer& found, std::uint64_t offset, const FileSource& bytes, DicomFile& file) {
  DicomPixels& pixels = file.pixels;
  if (!pixels.unsupported.empty()) return;
  const TransferSyntax syntax = transfer_syntax(pixels.syntax);
  if (syntax.use == SyntaxUse::deflated) {
    pixels.inflated = offset;
    return;
  }
  try {
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
std::optional<DicomFile> parsed_file(const std::string& path, std::string& series) {
  const FileSource bytes(path);
  const std::string beginning = beginning_of(bytes);
  const bool is_sure = has_magic(beginning);
  if (!is_sure && !may_be_dataset(beginning)) return std::nullopt;
  HeaderStream stream(bytes);
  DcmFileFormat format;
  format.transferInit();
  const OFCondition result =
      format.readUntilTag(stream, EXS_Unknown, EGL_noChange, longest_value, DCM_PixelData);
  format.transferEnd();
  stream.require_good();
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
  read_frames(dataset, most_frames(bytes, file), file);
  read_concatenation(dataset, file);
  file.pixels.unsupported = why_not_readable(dataset, file);
  find_samples(DcmXfer(dataset.getOriginalXfer()), offset, bytes, file);
  file.pixels.lossy = lossy_compression(dataset, file);
  note_stream_without_sign(file);
  make_units_utf8(dataset, file);
  file.texts = texts_of(dataset, file.notes);
  return file;
}

}  // namespace

std::optional<DicomFile> read_dicom_file(const std::string& path) {
  std::string series;
  try {
    return parsed_file(path, series);
  } catch (const BrokenInput& error) {
    throw BrokenDicomFile(path, error.what(), series);
  }
}

bool is_name_of_dicomdir(std::string_view name) {
  return lower_case(text_of(path_of(name).stem())) == "dicomdir";
}

std::optional<std::vector<std::string>> files_of_dicomdir(const std::string& path) {
  if (!has_magic(beginning_of(FileSource(path)))) return std::nullopt;
  DcmFileFormat format;
  const OFCondition result =
      format.loadFileUntilTag(OFFilename(path_of(path).c_str()), EXS_Unknown, EGL_noChange, longest_value,
                              ERM_autoDetect, DCM_PixelData);
  const auto type = text_of(*format.getMetaInfo(), DCM_MediaStorageSOPClassUID);
  if (!type || *type != UID_MediaStorageDirectoryStorage) return std::nullopt;
  if (result.bad()) throw BrokenInput("{}: DICOM directory: {}", path, result.text());
  if (!is_name_of_dicomdir(name_of_path(path)))
    throw BrokenInput(
        "{}: is a DICOM directory with another name, so the files that it names are not read; "
        "rename it to DICOMDIR",
        path);
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
    fs::path file = path_of(path).parent_path();
    for (const std::string_view part : values_of(*name)) {
      // A directory is untrusted input: it names files below its directory, and no others.
      if (!is_safe_name(part) || part.find('/') != part.npos)
        throw BrokenInput("{}: DICOM directory: names the file {}, which is not below it", path,
                          tagrid::quoted(std::string_view(*name)));
      file /= part;
    }
    files.push_back(text_of(file));
  }
  return files;
}

namespace {

constexpr std::uint64_t preamble = 128 + 4;  // bytes, with the magic
constexpr std::uint64_t longest_meta = 1 << 20;
constexpr std::size_t most_kept = std::size_t{4} << 20;  // of an inflated data set
constexpr std::size_t long_head = 12;                    // bytes of an element with a length of 4 bytes
constexpr std::string_view explicit_little_endian("1.2.840.10008.1.2.1\0", 20);

using Tag = std::pair<std::uint16_t, std::uint16_t>;
constexpr Tag pixel_data = {0x7FE0, 0x0010}, group_length = {0x7FE0, 0}, offset_table = {0x7FE0, 1},
              offset_table_lengths = {0x7FE0, 2}, item_of_fragments = {0xFFFE, 0xE000},
              sequence_end = {0xFFFE, 0xE0DD};

class Bytes {
 public:
  explicit Bytes(const std::string& path) : file_(path) {}

  std::uint64_t size() const { return file_.size(); }
  std::string at(std::uint64_t position, std::uint64_t count) const {
    if (position > size() || count > size() - position) throw NoPlainForm{"it ends too soon"};
    std::string bytes(memory_size(count), '\0');
    file_.read_at(position, std::as_writable_bytes(std::span(bytes)));
    return bytes;
  }
  template <class T>
  T number(std::uint64_t position) const {
    return load_little_endian<T>(reinterpret_cast<const std::byte*>(at(position, sizeof(T)).data()));
  }
  const ByteSource& file() const { return file_; }
  Tag tag(std::uint64_t position) const {
    return {number<std::uint16_t>(position), number<std::uint16_t>(position + 2)};
  }

 private:
  FileSource file_;
};

void store(std::string& bytes, std::size_t at, std::uint64_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) bytes[at + i] = static_cast<char>(value >> (8 * i) & 0xFF);
}

/// The head of native pixels.
std::string native_head(const std::string& vr, std::uint64_t samples) {
  std::string head(long_head, '\0');
  store(head, 0, pixel_data.first, 2);
  store(head, 2, pixel_data.second, 2);
  head.replace(4, 2, vr);
  store(head, 8, samples + samples % 2, 4);
  return head;
}

/// The meta information with another transfer syntax; `end` receives the byte after it.
std::string meta_of_plain_form(const Bytes& bytes, std::uint64_t& end) {
  std::string meta;
  std::optional<std::size_t> length_at;
  bool has_syntax = false;
  std::uint64_t at = preamble, counted_from = preamble;
  for (; bytes.tag(at).first == 0x0002; at = end) {
    const std::string vr = bytes.at(at + 4, 2);
    const bool is_long = vr == "OB" || vr == "OW" || vr == "UN" || vr == "UT" || vr == "SQ";
    const std::uint64_t head = is_long ? long_head : 8;
    const std::uint64_t length =
        is_long ? bytes.number<std::uint32_t>(at + 8) : bytes.number<std::uint16_t>(at + 6);
    end = at + head + length;
    if (end > longest_meta) throw NoPlainForm{"its meta information is too long"};
    std::string element = bytes.at(at, head + length);
    if (const std::uint16_t number = bytes.tag(at).second; number == 0x0000 && length == 4) {
      length_at = meta.size() + head;
      counted_from = end;
    } else if (number == 0x0010) {
      has_syntax = true;
      element.resize(head);
      store(element, 6, explicit_little_endian.size(), 2);
      element += explicit_little_endian;
    }
    meta += element;
  }
  if (!has_syntax) throw NoPlainForm{"it does not give its transfer syntax"};
  // A wrong one stays as it is.
  if (length_at && bytes.number<std::uint32_t>(counted_from - 4) == end - counted_from)
    store(meta, *length_at, meta.size() - *length_at - 4, 4);
  return meta;
}

/// Where the element of the pixels begins, or elements before it that describe nothing but its fragments.
std::uint64_t begin_of_pixels(const Bytes& bytes, const DicomFile& file) {
  std::uint64_t begin = *file.pixels.encapsulated - long_head;
  if (bytes.tag(begin) != pixel_data || bytes.number<std::uint32_t>(begin + 8) != unknown_length)
    throw NoPlainForm{"its pixels do not begin as fragments do"};
  const std::uint64_t table = long_head + 8 * file.frames.size();
  for (const auto& [tag, size] :
       {std::pair(offset_table_lengths, table), {offset_table, table}, {group_length, std::uint64_t{12}}})
    if (begin >= size && bytes.tag(begin - size) == tag) begin -= size;
  return begin;
}

/// The byte after the fragments.
std::uint64_t end_of_fragments(const Bytes& bytes, const DicomFile& file) {
  std::uint64_t at = *file.pixels.encapsulated;
  while (bytes.tag(at) == item_of_fragments) at += 8 + std::uint64_t{bytes.number<std::uint32_t>(at + 4)};
  if (bytes.tag(at) != sequence_end) throw NoPlainForm{"its fragments do not end as they should"};
  return at + 8;
}

/// What lies around the samples of an inflated data set.
struct InflatedDataset {
  std::string before, behind;
};

/// Inflates the bytes of a file from `begin` to its end, and leaves out `samples` bytes from byte `at` of the
/// result on. Takes little memory: it keeps at most `most_kept` bytes.
InflatedDataset inflated_dataset(const std::string& path, std::uint64_t begin, std::uint64_t at,
                                 std::uint64_t samples) {
  InflatedDataset dataset;
  std::uint64_t position = 0;
  const auto take = [&](std::span<const char> bytes) {
    while (!bytes.empty()) {
      const bool is_before = position < at, is_behind = position >= at + samples;
      const std::uint64_t end = is_before ? at : is_behind ? position + bytes.size() : at + samples;
      const std::size_t n = std::min<std::uint64_t>(bytes.size(), end - position);
      if (is_before) dataset.before.append(bytes.data(), n);
      if (is_behind) dataset.behind.append(bytes.data(), n);
      if (dataset.before.size() + dataset.behind.size() > most_kept)
        throw NoPlainForm{"its attributes are too many"};
      position += n;
      bytes = bytes.subspan(n);
    }
  };
  FileBytes file(path);
  file.seek(begin);
  CompressedBytes stream(file, Compression::deflate);
  std::string bytes(std::size_t{1} << 16, '\0');
  try {
    while (const std::size_t count = stream.read(reinterpret_cast<std::byte*>(bytes.data()), bytes.size()))
      take(std::span(bytes).first(count));
  } catch (const BrokenInput&) {
    throw NoPlainForm{"its deflated data set is damaged, or ends too soon"};
  }
  if (position < at + samples) throw NoPlainForm{"its deflated data set ends too soon"};
  return dataset;
}

/// The pieces of a file whose data set is deflated. All of its bytes stay as they are, but for the transfer
/// syntax.
std::vector<PlainPiece> pieces_of_inflated(const DicomFile& file, std::size_t number,
                                           std::uint64_t& samples_at) {
  const Bytes bytes(file.path);
  const std::uint64_t samples = file.frames.size() * file.pixels.frame_bytes();
  if (bytes.at(preamble - 4, 4) != "DICM") throw NoPlainForm{"it has no meta information"};
  std::uint64_t end_of_meta = preamble;
  const std::string meta = meta_of_plain_form(bytes, end_of_meta);
  if (*file.pixels.inflated < end_of_meta + long_head) throw NoPlainForm{"its pixels cannot be found"};
  const InflatedDataset dataset =
      inflated_dataset(file.path, end_of_meta, *file.pixels.inflated - end_of_meta, samples);
  const std::string vr = dataset.before.substr(dataset.before.size() - 8, 2);  // OB or OW
  if (!dataset.before.ends_with(native_head(vr, samples)))
    throw NoPlainForm{"its pixels do not begin as native ones do"};
  samples_at = preamble + meta.size() + dataset.before.size();
  return {PlainPiece::stretch(number, 0, preamble), PlainPiece::given(meta + dataset.before),
          PlainPiece::samples(samples), PlainPiece::given(dataset.behind)};
}

std::vector<PlainPiece> pieces_of(const DicomFile& file, std::size_t number, std::uint64_t& samples_at) {
  const Bytes bytes(file.path);
  const std::uint64_t samples = file.frames.size() * file.pixels.frame_bytes();
  if (bytes.at(preamble - 4, 4) != "DICM") throw NoPlainForm{"it has no meta information"};
  if (samples >= unknown_length - 1) throw NoPlainForm{"its samples are more than native ones can be"};
  std::uint64_t end_of_meta = preamble;
  const std::string meta = meta_of_plain_form(bytes, end_of_meta);
  const std::uint64_t begin = begin_of_pixels(bytes, file);
  if (begin < end_of_meta) throw NoPlainForm{"its pixels cannot be found"};
  const std::string head = native_head(file.pixels.allocated > 8 ? "OW" : "OB", samples);
  samples_at = preamble + meta.size() + (begin - end_of_meta) + head.size();
  return {PlainPiece::stretch(number, 0, preamble),
          PlainPiece::given(meta),
          PlainPiece::stretch(number, end_of_meta, begin),
          PlainPiece::given(head),
          PlainPiece::samples(samples),
          PlainPiece::given(std::string(samples % 2, '\0')),
          PlainPiece::stretch(number, end_of_fragments(bytes, file), bytes.size())};
}

}  // namespace

bool may_have_wider_streams(const DicomFile& file) {
  if (file.pixels.is_jpeg_xl())
    return bits_of_jpeg_xl(file).value_or(file.pixels.allocated) > file.pixels.stored;
  if (!file.pixels.is_jpeg2000()) return false;
  try {
    const Bytes bytes(file.path);
    const std::uint64_t stream = first_stream(bytes.file(), *file.pixels.encapsulated);
    constexpr std::uint64_t precision_at = 42;  // SOC, SIZ and the fields before Ssiz
    return (bytes.number<std::uint8_t>(stream + precision_at) & 0x7F) + 1 > file.pixels.stored;
  } catch (const NoPlainForm&) {
    return true;
  } catch (const BrokenInput&) {
    return true;
  }
}

ReaderPlainFile plain_dicom_file(const DicomFile& file, std::size_t number, std::uint64_t& samples_at) {
  ReaderPlainFile plain;
  if (file.pixels.offset) {
    samples_at = *file.pixels.offset;
    plain.pieces = {PlainPiece::stretch(number, 0, FileSource(file.path).size())};
    return plain;
  }
  try {
    plain.compression = file.pixels.syntax_name;
    plain.pieces = file.pixels.inflated ? pieces_of_inflated(file, number, samples_at)
                                        : pieces_of(file, number, samples_at);
  } catch (const NoPlainForm& none) {
    plain.why_not = none.why;
  }
  return plain;
}

}  // namespace tagrid
