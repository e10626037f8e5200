// A DICOM file that is exported.
#include "io/errors/errors.h"
#include "io/formats/dicom/exported.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void dicom(Bytes bytes) {
  const BytesInMemory file(std::as_bytes(bytes));
  for (const char* loss : {"", "largest error 1"}) try {
      std::uint64_t end = 0, given = 0;
      for (const PlainPiece& piece :
           exported_dicom_file(file, "fuzzed", {.done = "fuzzed", .loss = loss, .ratio = 2})) {
        if (piece.kind == PlainPiece::Kind::given) {
          given += piece.bytes.size();
          continue;
        }
        claim(piece.kind == PlainPiece::Kind::stretch && piece.size, "pieces are given or stretches");
        claim(piece.offset >= end && piece.offset <= file.size() && *piece.size <= file.size() - piece.offset,
              "stretches follow each other in the file");
        end = piece.offset + *piece.size;
      }
      // New attributes, and copies of values that get longer.
      claim(given <= 2 * file.size() + 4096, "no more is made than there is");
    } catch (const BrokenInput&) {
    }
}

}  // namespace tagrid::fuzz
