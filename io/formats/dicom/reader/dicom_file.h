// What one DICOM file says, without its samples, and its plain form. The standard: https://dicom.nema.org
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/dicom/reader/moments.h"
#include "io/programs/reader_conversation.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// A sentence without a full stop and without the name of the file. Files of a series mostly have the same
/// ones; those about one thing are reported once.
struct DicomNote {
  std::string about;  ///< "RescaleSlope"
  std::string text;   ///< "RescaleSlope is empty; ..."
};

struct DicomNotes {
  std::vector<DicomNote> warnings;
  /// Those after which a lossy encoding must not replace the file; see SourceFacts.
  std::vector<DicomNote> not_understood;
  /// Those that leave the values of samples unknown.
  std::vector<DicomNote> scale_doubts;

  void warn(std::string about, std::string text) { add(warnings, std::move(about), std::move(text)); }
  void miss(std::string about, std::string text) { add(not_understood, std::move(about), std::move(text)); }
  void doubt(std::string about, std::string text) { add(scale_doubts, std::move(about), std::move(text)); }

 private:
  /// Adds a note, unless there is one about the same thing.
  static void add(std::vector<DicomNote>& notes, std::string about, std::string text) {
    if (std::ranges::find(notes, about, &DicomNote::about) == notes.end())
      notes.push_back({std::move(about), std::move(text)});
  }
};

using Vector3 = std::array<double, 3>;

/// One image: an entire file, or a frame of it.
struct DicomFrame {
  std::optional<Vector3> position;  ///< of the first sample, in mm, left-posterior-superior
  /// Along a row and along a column, of length 1 but for rounding.
  std::optional<std::array<Vector3, 2>> orientation;
  std::optional<std::array<double, 2>> spacing;  ///< along x and along y, in mm
  double thickness = 0;                          ///< or the distance of slices, if given; 0: unknown
  double step = 0;                               ///< the distance of slices with its sign; 0: unknown
  Rescale rescale;
  Moments moments;          ///< besides those of its file
  std::int64_t number = 0;  ///< of the image in its series
};

/// The vector of length 1 in the same direction.
Vector3 unit_of(const Vector3& vector);

/// The vector of length 1 at right angles to an image. REQUIRES: orientation.
Vector3 normal_of(const DicomFrame& frame);

/// How the samples of a file are stored.
struct DicomPixels {
  struct Stretch {
    std::uint64_t offset = 0, length = 0;
  };

  std::int64_t columns = 0, rows = 0;
  int allocated = 0, stored = 0;  ///< bits of a sample, and those that count
  bool is_signed = false;
  std::string photometric;          ///< "MONOCHROME2"
  std::string syntax, syntax_name;  ///< the UID, and its usual name
  /// The byte of the file at which samples lie plainly; nothing if they must be decoded, or lie in pieces.
  std::optional<std::uint64_t> offset;
  std::uint64_t step = 0;  ///< from the beginning of a frame to that of the next one, if samples lie plainly
  /// Pieces of the file that hold all frames, one after the other, if they lie plainly in pieces of other
  /// sizes than frames.
  std::vector<Stretch> stretches;
  /// The byte at which fragments begin that hold them; nothing if there are none.
  std::optional<std::uint64_t> encapsulated;
  /// The byte at which samples would lie plainly if the data set of the file were inflated; nothing if it is
  /// not deflated.
  std::optional<std::uint64_t> inflated;
  bool big_endian = false;
  std::string unsupported;  ///< why the samples cannot be read: "has colors"; "" if they can
  bool is_cut = false;      ///< that is why: the file does not have all of them
  /// If samples were compressed with a loss, here or before: by what, "DICOM, ISO_10918_1"; "" if that is not
  /// known.
  std::string lossy;

  std::uint64_t frame_bytes() const {
    return static_cast<std::uint64_t>(columns * rows) * static_cast<std::uint64_t>(allocated / 8);
  }
  bool is_jpeg2000() const {
    return syntax == "1.2.840.10008.1.2.4.90" || syntax == "1.2.840.10008.1.2.4.91" || is_ht_jpeg2000();
  }
  /// JPEG 2000 with another coder of its bits, which OpenJPEG decodes, too.
  bool is_ht_jpeg2000() const {
    return syntax == "1.2.840.10008.1.2.4.201" || syntax == "1.2.840.10008.1.2.4.202" ||
           syntax == "1.2.840.10008.1.2.4.203";
  }
  bool is_jpeg_xl() const {
    return syntax == "1.2.840.10008.1.2.4.110" || syntax == "1.2.840.10008.1.2.4.111" ||
           syntax == "1.2.840.10008.1.2.4.112";
  }
};

struct DicomFile {
  std::string path;
  std::string series, instance;  ///< UIDs
  std::string image_type;        ///< the third value: "AXIAL", "LOCALIZER"
  bool is_mr = false;            ///< of magnetic resonance, by its Modality
  DicomPixels pixels;
  std::vector<DicomFrame> frames;
  Moments moments;  ///< of all frames
  DicomNotes notes;
  /// The number of files in the concatenation that this file belongs to, and its UID; 0 if there is none.
  std::int64_t concatenated = 0;
  std::string concatenation;
  /// Texts by the standard's names of attributes, "PatientName", in UTF-8.
  std::map<std::string, std::string> texts;
};

/// A file of DICOM that cannot be read.
class BrokenDicomFile : public BrokenInput {
 public:
  BrokenDicomFile(const std::string& path, std::string reason, std::string uid)
      : BrokenInput(path + ": DICOM file: " + reason), why(std::move(reason)), series(std::move(uid)) {}

  std::string why;     ///< "ends too soon"
  std::string series;  ///< the UID of its series, if it could be read so far; otherwise ""
};

/// Reads the header of a file. Nothing if the file is not one of DICOM; no frames if it is one without an
/// image, such as a report. Throws BrokenDicomFile and WorldError.
std::optional<DicomFile> read_dicom_file(const std::string& path);

/// True for the name that DICOM gives to such directories, with any extension. The reader may open
/// everything below one. The name alone decides, so that no other file gets this access by claiming
/// to be one.
bool is_name_of_dicomdir(std::string_view name);

/// The files of images to which a DICOMDIR refers; nothing if the file is none. Throws BrokenInput.
std::optional<std::vector<std::string>> files_of_dicomdir(const std::string& path);

/// The plain form of a file, which is number `number` among those of its volume, without the places of
/// slices: the same data set in Explicit VR Little Endian. All attributes stay as they are, byte for byte,
/// except the transfer syntax and what describes the compressed pixels. `samples_at` receives the byte at
/// which the first frame begins. A file whose samples lie plainly is its own plain form. Throws WorldError.
/// REQUIRES: pixels.offset, pixels.encapsulated or pixels.inflated.
ReaderPlainFile plain_dicom_file(const DicomFile& file, std::size_t number, std::uint64_t& samples_at);

/// True if the code streams of a file may have more bits than it says, as those of some JPEG 2000 encoders
/// do. Native samples have no room for numbers that need them. REQUIRES: pixels.encapsulated.
bool may_have_wider_streams(const DicomFile& file);

}  // namespace tagrid
