#include "io/errors/errors.h"
#include "io/formats/dicom/reader/jpeg_xl.h"

namespace tagrid {
namespace {

[[noreturn]] void refuse() {
  throw WorldError(
      "the series is compressed with JPEG XL, which this static program cannot decode; use tagrid's packages "
      "for Debian");
}

}  // namespace

JpegXlImage decode_jpeg_xl(std::span<const std::byte>, std::int64_t, std::int64_t) { refuse(); }
JpegXlImage jpeg_xl_header(std::span<const std::byte>) { refuse(); }

}  // namespace tagrid
