// Limits that a shell or a batch system sets: exit code 74, the file, the reason, and nothing left behind.

#include <unistd.h>

#include "tests/support/command_line.h"

namespace tagrid {
namespace {

struct Output {
  const char *words, *name;
};

class ProcessLimits : public CommandLine {
 protected:
  static constexpr Output outputs[] = {
      {"encode volume.nrrd", "new.tag"},          {"decode volume.tag", "new.nrrd"},
      {"decode volume.tag", "new.raw"},           {"mesh volume.tag", "new.vtu"},
      {"surface volume.tag --iso 40", "new.vtp"}, {"surface volume.tag --iso 40", "new.stl"},
      {"preview volume.tag", "new.png"}};
};

// The signal SIGXFSZ would end the process.
TEST_F(ProcessLimits, AFileThatMayNotGrowIsAnErrorAndTheAdviceHelps) {
  make_tag();
  const std::vector<std::string> before = names();
  for (const auto& [words, name] : outputs) {
    SCOPED_TRACE(name);
    const std::string command = std::string("$TAGRID ") + words + " -q -o " + name;
    for (const char* kibibytes : {"0", "1", "8"}) {
      const Ending ending = script("ulimit -S -f " + std::string(kibibytes) + "; " + command);
      expect_error(ending, world, "File too large; raise the limit on the size of files (ulimit -f)");
      EXPECT_TRUE(ending.err.find(name) != ending.err.npos ||
                  ending.err.find("a temporary file in") != ending.err.npos)
          << ending.err;
      EXPECT_EQ(names(), before);
    }
    expect_ok(script("ulimit -S -f 0; ulimit -S -f unlimited; " + command));
    std::filesystem::remove(path(name));
  }
}

TEST_F(ProcessLimits, TooFewOpenFilesAreAnErrorAndTheAdviceHelps) {
  make_tag();
  std::filesystem::create_directory(path("slices"));
  for (int z = 100; z < 136; ++z) file("slices/" + std::to_string(z) + ".raw", std::string(52 * 40 * 2, 'x'));
  std::vector<Output> all(std::begin(outputs), std::end(outputs));
  all.push_back({"encode slices --dims 52,40,36 --type int16", "new.tag"});
  const std::vector<std::string> before = names();
  for (const auto& [words, name] : all) {
    SCOPED_TRACE(std::string(words) + " " + name);
    const std::string command = std::string("$TAGRID ") + words + " -q -o " + name;
    int failed = 0;
    // The first ones are those of this test, and one that the loader needs.
    constexpr int loader_failed = 127;
    for (int files = 4; files < 40; ++files) {
      const Ending ending = script("ulimit -S -n " + std::to_string(files) + "; exec " + command);
      if (ending.code == 0) break;
      if (ending.code == loader_failed) continue;
      ++failed;
      expect_error(ending, world, "Too many open files; raise the limit on open files (ulimit -n)");
      EXPECT_EQ(names(), before);
    }
    EXPECT_GT(failed, 0);
    EXPECT_LT(failed, 16) << "not even with many";
    std::filesystem::remove(path(name));
  }
}

// Root has no limit on processes.
TEST_F(ProcessLimits, TooManyProcessesAreAnErrorAndTheAdviceHelps) {
  make_tag();
  const std::string as_other =
      geteuid() == 0 ? "setpriv --reuid=54321 --regid=54321 --clear-groups --no-new-privs " : "";
  if (geteuid() == 0 && script("chmod 777 . && " + as_other + "test -x $TAGRID").code != 0)
    GTEST_SKIP() << "there is no setpriv, or another user cannot run the program";
  const std::vector<std::string> before = names();
  const auto decode = [&](const std::string& limit) {
    return script(as_other + "bash -c 'ulimit -S -u " + limit +
                  "; exec \"$0\" decode volume.tag -T1 -qo new.h5' $TAGRID");
  };
  expect_error(decode("1"), world,
               "tagrid-write-hdf5: cannot start a process for it, as there are too many; raise");
  EXPECT_EQ(names(), before);
  expect_ok(decode("unlimited"));
}

TEST_F(ProcessLimits, AFileSystemThatIsReadOnlyIsAnErrorThatSaysSo) {
  make_tag();
  if (script("unshare -m bash -c 'mkdir ro && mount --bind ro ro && mount -o remount,bind,ro ro'").code != 0)
    GTEST_SKIP() << "this user cannot mount";
  for (const auto& [words, name] : outputs) {
    SCOPED_TRACE(name);
    expect_error(script("unshare -m bash -c 'mount --bind ro ro && mount -o remount,bind,ro ro && exec $0 " +
                        std::string(words) + " -q -o ro/" + name + "' $TAGRID"),
                 world, "Read-only file system; choose another folder");
  }
  EXPECT_EQ(script("ls -A ro").out, "");
}

}  // namespace
}  // namespace tagrid
