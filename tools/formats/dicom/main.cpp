// tagrid-read-dicom: reads DICOM series with DCMTK and OpenJPEG.

#include <dcmtk/config/osconfig.h>
// The configuration comes first.
#include <dcmtk/dcmdata/dcvr.h>
#include <dcmtk/oflog/oflog.h>

#include "io/programs/serve_reader.h"
#include "tools/formats/dicom/dicom_volumes.h"

int main() {
  // What is wrong is said in answers.
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  // Archives store unknown attributes as UN.
  dcmEnableUnknownVRConversion.set(OFTrue);
  return tagrid::serve_volumes("dicom", tagrid::open_dicom);
}
