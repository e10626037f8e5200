// A DICOM file with samples that went through a .tag file, as an image of its own: new UIDs, a reference to the original,
// and the marks of a lossy image. All other bytes stay as they are.
#pragma once

#include <string>
#include <vector>

#include "io/files/byte_source.h"
#include "io/volume/sample_places.h"

namespace tagrid {

/// What became of the samples of a series.
struct DicomExport {
  /// What was done, for the new UIDs: the same text gives the same ones.
  std::string done;
  /// What was done, in words of ASCII, if samples are not exact; "" if they are.
  std::string loss;
  double ratio = 1;  ///< of the bytes of the samples to those that they were compressed to
  /// Samples were compressed with a loss before, which perhaps only their transfer syntax says.
  bool was_lossy = false;
};

/// The pieces of the exported file: given bytes, and stretches of `file`, one of which is the entire value of PixelData.
/// `name` is for messages. Throws BrokenInput if it is not a DICOM file with an image and its UIDs, or if its samples are
/// compressed; WorldError.
std::vector<PlainPiece> exported_dicom_file(const ByteSource& file, const std::string& name,
                                            const DicomExport& how);

}  // namespace tagrid
