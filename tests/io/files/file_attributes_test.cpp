#include "io/files/file_attributes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "io/errors/errors.h"
#include "io/text/paths.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

class RealPaths : public TemporaryFolder {
 protected:
  RealPaths() {
    folder_ = fs::canonical(folder_);
    fs::create_directories(folder_ / "a/b");
    file("a/b/scan.nrrd", "x");
    fs::create_symlink("a/b", folder_ / "link");
    fs::create_symlink(folder_ / "missing", folder_ / "dangling");
    fs::create_symlink("loop", folder_ / "loop");
  }
};

// The second implementation is that of the standard library.
TEST_F(RealPaths, AreThoseOfTheStandardLibrary) {
  for (const char* name :
       {"", ".", "a", "a/b/scan.nrrd", "a/b/", "a/./b/../b", "link", "link/scan.nrrd", "link/..", "link/../x",
        "link/new/../other", "new", "new/deep/file", "new/../a/b", "a/b/scan.nrrd/file", "dangling"}) {
    const fs::path path = folder_ / name;
    EXPECT_EQ(real_path(path), fs::weakly_canonical(path)) << name;
  }
  EXPECT_EQ(real_path("/"), "/");
  EXPECT_EQ(real_path("/no such directory/.."), "/");
  EXPECT_EQ(real_path(""), "");
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  // The standard library leaves these as they are.
  EXPECT_EQ(real_path("new"), folder_ / "new");
  EXPECT_EQ(real_path("./link/new"), folder_ / "a/b/new");
  fs::current_path(before);
}

// A name after which ".." follows may be a link, so nothing is said by names alone.
TEST_F(RealPaths, AreUnknownWhereNobodyCanLook) {
  for (const char* name : {"loop", "link/../../loop/../a"}) {
    EXPECT_THROW(real_path(folder_ / name), WorldError) << name;
    EXPECT_EQ(real_path_if_known(folder_ / name), folder_ / name);
  }
  EXPECT_EQ(real_path_if_known(folder_ / "link/new"), folder_ / "a/b/new");
  const fs::path before = fs::current_path();
  fs::create_directory(folder_ / "gone");
  fs::current_path(folder_ / "gone");
  fs::remove(folder_ / "gone");
  EXPECT_THROW(absolute_path("a"), WorldError);
  EXPECT_THROW(real_path("../a"), WorldError);
  EXPECT_THROW(real_path_if_known("../a"), WorldError);
  fs::current_path(before);
}

}  // namespace
}  // namespace tagrid
