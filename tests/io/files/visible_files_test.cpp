// The files of a folder that may be parts of a volume.
#include "io/files/visible_files.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

class VisibleFiles : public TemporaryFolder {};

TEST_F(VisibleFiles, AreTheFilesAndLinksToFilesInNaturalOrder) {
  fs::create_directory(path("in"));
  for (const char* name : {"in/s10", "in/s9", "in/.hidden", "elsewhere"}) file(name, "x");
  fs::create_directory(path("in/folder"));
  fs::create_symlink(path("elsewhere"), path("in/s11"));
  fs::create_symlink(path("in/folder"), path("in/s12"));
  EXPECT_EQ(visible_files(path("in")), (std::vector{path("in/s9"), path("in/s10"), path("in/s11")}));
  EXPECT_THROW(visible_files(path("absent")), WorldError);
}

TEST_F(VisibleFiles, ALinkThatLeadsNowhereIsNotPassedOver) {
  fs::create_directory(path("in"));
  fs::create_symlink(path("lost"), path("in/s1"));
  EXPECT_EQ(visible_files(path("in")), std::vector{path("in/s1")});
}

}  // namespace
}  // namespace tagrid
