// A file of lines is whole after every line, and has one writer.
#include "io/files/line_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using LineFileTest = TemporaryFolder;

TEST_F(LineFileTest, LinesAreThereAtOnceAndFollowThoseOfEarlierRuns) {
  {
    LineFile lines(path("a"));
    EXPECT_EQ(lines.name(), path("a"));
    lines.append("one");
    EXPECT_EQ(content("a"), "one\n");
    lines.append("");
  }
  LineFile(path("a")).append("two");
  EXPECT_EQ(content("a"), "one\n\ntwo\n");
}

TEST_F(LineFileTest, HalfALineAtTheEndIsCutOff) {
  // The last end of a line lies in any of the pieces that are searched, of 4096 bytes.
  for (const std::size_t before : {0U, 1U, 5000U})
    for (const std::size_t half : {0U, 1U, 4094U, 4095U, 4096U, 4097U, 9000U}) {
      const std::string whole = before == 0 ? "" : std::string(before, 'w') + "\n";
      file("a", whole + std::string(half, 'h'));
      LineFile(path("a")).append("new");
      EXPECT_TRUE(content("a") == whole + "new\n") << before << " " << half;
    }
}

TEST_F(LineFileTest, ASecondWriterIsRefusedUntilTheFirstHasEnded) {
  {
    const LineFile first(path("a"));
    EXPECT_THROW(LineFile(path("a")), UsageError);
  }
  EXPECT_NO_THROW(LineFile(path("a")));
}

TEST_F(LineFileTest, WhatIsNoFileIsRefusedWithoutWaiting) {
  std::filesystem::create_directory(path("folder"));
  EXPECT_THROW(LineFile(path("folder")), WorldError);
  EXPECT_THROW(LineFile(path("none/a")), WorldError);
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_THROW(LineFile(path("pipe")), UsageError);
}

}  // namespace
}  // namespace tagrid
