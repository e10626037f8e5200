// Bytes that wait in a nameless file come back, whatever the order in which they were written.
#include "io/files/spool_file.h"

#include <gtest/gtest.h>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

class SpoolFileTest : public TemporaryFolder {
 protected:
  static std::vector<std::byte> counted(std::size_t size, unsigned step = 1) {
    std::vector<std::byte> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * step >> 3);
    return bytes;
  }
  static std::vector<std::byte> read_all(SpoolFile& spool) {
    std::vector<std::byte> all;
    spool.read_back([&](std::span<std::byte> part) { all.insert(all.end(), part.begin(), part.end()); });
    return all;
  }
};

TEST_F(SpoolFileTest, WhatWasWrittenInOrderComesBackInAnyPieces) {
  // Around the size of its buffer, 1 MiB.
  for (const std::size_t size : {0U, 1U, (1U << 20) - 1, 1U << 20, (1U << 20) + 1, 2'500'000U}) {
    SpoolFile spool = SpoolFile::in(folder_.string(), "x");
    const auto bytes = counted(size);
    for (std::size_t at = 0; at < size; at += 70'001)
      spool.write(std::span(bytes).subspan(at, std::min<std::size_t>(70'001, size - at)));
    EXPECT_EQ(spool.size(), size);
    EXPECT_TRUE(read_all(spool) == bytes) << size;
    EXPECT_TRUE(read_all(spool) == bytes) << "once more";
    if (size < 100) continue;
    std::vector<std::byte> some(99);
    spool.read_at(size - 99, some);
    EXPECT_TRUE(std::equal(some.begin(), some.end(), bytes.end() - 99));
  }
}

TEST_F(SpoolFileTest, WhatWasWrittenAtItsPlaceComesBackInOrderAndNothingOfBeforeIsLeft) {
  SpoolFile spool = SpoolFile::in(folder_.string(), "x");
  for (const unsigned step : {1U, 3U}) {
    // The second time, there is less: the bytes behind it are gone.
    const auto bytes = counted(2'000'000 / step, step);
    const std::size_t half = bytes.size() / 2;
    spool.write_at(half, std::span(bytes).subspan(half));
    spool.write_at(0, std::span(bytes).first(half));
    EXPECT_TRUE(read_all(spool) == bytes) << step;
    spool.clear();
    EXPECT_EQ(spool.size(), 0U);
  }
}

TEST_F(SpoolFileTest, PlacesMayBeWrittenAgainAfterTheyWereRead) {
  SpoolFile spool = SpoolFile::in(folder_.string(), "x");
  std::vector<std::byte> read(1000);
  for (const unsigned step : {1U, 3U, 5U}) {
    const auto bytes = counted(1000, step);
    spool.write_at(5000, bytes);
    spool.read_at(5000, read);
    EXPECT_TRUE(read == bytes) << step;
    spool.write_at(7000, bytes);
    EXPECT_EQ(spool.size(), 8000U);
  }
}

TEST_F(SpoolFileTest, HasNoNameAndLiesBesideItsOutputOrInItsFolder) {
  file("out.nrrd", "older");
  SpoolFile beside = SpoolFile::beside(path("out.nrrd")), in = SpoolFile::in(folder_.string(), "x"),
            elsewhere = SpoolFile::beside("/dev/null");
  beside.write(counted(3'000'000));
  EXPECT_EQ(names(), std::vector<std::string>{"out.nrrd"});
}

TEST_F(SpoolFileTest, AFolderThatIsNotThereIsNamedWithWhomItIsFor) {
  try {
    SpoolFile::in(path("none"), "scan.nrrd");
    ADD_FAILURE();
  } catch (const WorldError& error) {
    EXPECT_NE(std::string(error.what()).find("scan.nrrd: cannot create a temporary file in " + path("none")),
              std::string::npos)
        << error.what();
  }
}

TEST_F(SpoolFileTest, ReadingBehindTheEndIsAnErrorOfTheWorld) {
  SpoolFile spool = SpoolFile::in(folder_.string(), "x");
  spool.write(counted(10));
  std::vector<std::byte> some(11);
  EXPECT_THROW(spool.read_at(0, some), WorldError);
}

}  // namespace
}  // namespace tagrid
