// The bytes of plain forms: those of a compressed stream count only if its end says that all of them were right.
#include "io/envelope/plain_bytes.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "tests/support/gzipped.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

class PlainBytesOfStreams : public TemporaryFolder {};

TEST_F(PlainBytesOfStreams, AreCheckedToTheEnd) {
  const std::string samples(1000, 'a');
  std::string packed = gzipped(samples);
  const std::vector<PlainPiece> pieces = {PlainPiece::content(0, 0, samples.size()),
                                          PlainPiece::given("end")};
  std::vector<std::byte> bytes(samples.size() + 3);
  PlainBytes(pieces, {file("whole.gz", packed)}).read_at(0, bytes);
  EXPECT_EQ(bytes.front(), std::byte{'a'});
  EXPECT_EQ(bytes.back(), std::byte{'d'});
  packed[packed.size() - 8] ^= 1;  // of the checksum
  EXPECT_THROW(PlainBytes(pieces, {file("damaged.gz", packed)}).read_at(0, bytes), BrokenInput);
  EXPECT_THROW(PlainBytes({PlainPiece::content(0, 0, 999)}, {path("whole.gz")})
                   .read_at(0, std::span(bytes).first(999)),
               BrokenInput);
}

}  // namespace
}  // namespace tagrid
