// A reader that a malicious file controls: each attempt succeeds without the sandbox, and fails within it.

#include "io/sandbox/sandbox.h"
#include "io/metadata/metadata.h"

#include <arpa/inet.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <array>

#include "io/programs/volumes.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

/// A port of this machine at which somebody listens.
class Listener {
 public:
  Listener() : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* any = reinterpret_cast<sockaddr*>(&address);
    if (bind(socket_, any, size) != 0 || listen(socket_, 4) != 0 || getsockname(socket_, any, &size) != 0)
      throw std::runtime_error("cannot listen");
    port_ = ntohs(address.sin_port);
  }
  ~Listener() { close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  std::string port() const { return std::to_string(port_); }

 private:
  int socket_, port_ = 0;
};

class Sandbox : public TemporaryFolder {
 protected:
  Sandbox() {
    std::filesystem::create_directory(path("scans"));
    std::filesystem::create_directory(path("elsewhere"));
  }
  void SetUp() override {
    if (!sandbox_is_on()) GTEST_SKIP() << "the sandbox is off here: sanitizers, or TAGRID_SANDBOX=off";
    if (landlock_version() == 0) GTEST_SKIP() << "this kernel has no Landlock";
  }
  ~Sandbox() override { unsetenv("TAGRID_SANDBOX"); }

  /// What comes of it if the reader of scans/a.ramp tries to do this, and if a thread of it does.
  std::array<std::string, 2> outcomes(const std::string& what, const std::string& at) const {
    const auto source =
        open_with_reader(TAGRID_RAMP_READER, file("scans/a.ramp", "3 4 5 tries " + what + " " + at), {});
    const Metadata& metadata = source->info().metadata;
    return {metadata.text_of("outcome"), metadata.text_of("outcome of a thread")};
  }
  void expect_refused(const std::string& what, const std::string& at) const {
    for (const std::string& outcome : outcomes(what, at)) {
      EXPECT_NE(outcome, "done") << what << " " << at;
      EXPECT_NE(outcome, "Invalid argument") << what << " " << at;
      EXPECT_NE(outcome, "") << what << " " << at;
    }
  }
  void expect_done(const std::string& what, const std::string& at) const {
    EXPECT_EQ(outcomes(what, at)[0], "done") << what << " " << at;
  }
};

TEST_F(Sandbox, KeepsAReaderFromTheRestOfTheMachine) {
  const Listener listener;
  const std::string other = file("elsewhere/secret", "secret"), own = file("scans/b.ramp", "1 1 1 any");
  for (const char* what : {"change", "truncate", "remove", "rename"}) expect_refused(what, own);
  for (const char* what : {"change", "read"}) expect_refused(what, other);
  for (const char* folder : {"scans/new", "elsewhere/new"}) expect_refused("write", path(folder));
  for (const char* folder : {"elsewhere", ""}) expect_refused("list", path(folder));
  for (const char* what : {"start", "become"}) expect_refused(what, "/bin/true");
  for (const char* what : {"talk", "broadcast", "signal"}) expect_refused(what, "-");
  expect_refused("read", "/etc/passwd");
  expect_refused("connect", listener.port());
  EXPECT_EQ(content("scans/b.ramp"), "1 1 1 any");
  EXPECT_EQ(names_in("scans"), (std::vector<std::string>{"a.ramp", "b.ramp"}));
  EXPECT_EQ(names_in("elsewhere"), std::vector<std::string>{"secret"});
}

TEST_F(Sandbox, LetsItReadTheSourceAndWhatLinksLeadTo) {
  file("scans/b.ramp", "1 1 1 any");
  const std::string other = file("elsewhere/slice.ramp", "x");
  std::filesystem::create_symlink(other, path("scans/link.ramp"));
  expect_done("read", path("scans/a.ramp"));
  expect_done("read", path("scans/b.ramp"));
  expect_done("list", path("scans"));
  expect_done("read", path("scans/link.ramp"));
  // Samples lie beside the header itself, not beside a link to it.
  std::filesystem::create_symlink(file("elsewhere/c.ramp", "3 4 5 tries read " + other),
                                  path("scans/c.ramp"));
  const auto source = open_with_reader(TAGRID_RAMP_READER, path("scans/c.ramp"), {});
  EXPECT_EQ(source->info().metadata.text_of("outcome"), "done");
}

// A scan in the home of a user is no way to the rest of it.
TEST_F(Sandbox, KeepsAReaderFromWhatLiesBesideTheSource) {
  for (const char* folder : {"scans/.ssh", "scans/more", "scans/d.ramp"})
    std::filesystem::create_directory(path(folder));
  std::filesystem::create_symlink(path("elsewhere"), path("scans/folder.ramp"));
  for (const char* name :
       {"scans/.ssh/id", "scans/.netrc", "scans/.hidden.ramp", "scans/notes.txt", "scans/credentials",
        "scans/more/e.ramp", "scans/d.ramp/f.ramp", "elsewhere/g.ramp"})
    expect_refused("read", file(name, "secret"));
  expect_refused("read", path("scans/folder.ramp/g.ramp"));
}

// Of a directory: all that is not hidden.
TEST_F(Sandbox, LetsItReadADirectoryWithoutWhatIsHiddenThere) {
  std::filesystem::create_directories(path("scans/more/.zarr"));
  std::filesystem::create_directory(path("scans/.ssh"));
  for (const char* name :
       {"scans/.ssh/id", "scans/.netrc", "scans/b", "scans/.zarray", "scans/more/.zarr/c", "elsewhere/d"})
    file(name, "x");
  std::filesystem::create_symlink(path("elsewhere/d"), path("scans/more/link"));
  const auto tries = [&](const std::string& at) {
    EXPECT_EXIT(
        {
          confine_to(path("scans"), {});
          _exit(open(at.c_str(), O_RDONLY) < 0 ? 1 : 0);
        },
        ::testing::ExitedWithCode(at.find(".ssh") != at.npos || at.find(".netrc") != at.npos ||
                                  at.find("passwd") != at.npos),
        "")
        << at;
  };
  for (const char* name : {"scans", "scans/b", "scans/.zarray", "scans/more", "scans/more/.zarr/c",
                           "scans/more/link", "scans/.ssh/id", "scans/.netrc"})
    tries(path(name));
  tries("/etc/passwd");
}

// Of a part of it: what links in the part, above it and beside it lead to.
TEST_F(Sandbox, LooksForLinksOnlyWhereThePartThatIsReadNeedsThem) {
  for (const char* folder : {"elsewhere/array", "scans/part/deep", "scans/other"})
    std::filesystem::create_directories(path(folder));
  for (const char* name : {"scans/other/b", "elsewhere/c", "elsewhere/d", "elsewhere/e", "elsewhere/array/f"})
    file(name, "x");
  std::filesystem::create_symlink(path("elsewhere/c"), path("scans/part/deep/link"));
  std::filesystem::create_symlink(path("elsewhere/d"), path("scans/link"));
  std::filesystem::create_symlink(path("elsewhere/e"), path("scans/other/link"));
  std::filesystem::create_directory_symlink(path("elsewhere/array"), path("scans/linked"));
  const auto can_read = [&](const std::string& part, const std::string& at) {
    const auto tries = [&] {
      confine_to(path("scans"), {}, part);
      _exit(open(path(at).c_str(), O_RDONLY) < 0 ? 1 : 0);
    };
    EXPECT_EXIT(tries(), ::testing::ExitedWithCode(at == "scans/other/link" && part == "part"), "") << at;
  };
  for (const char* name :
       {"scans/part/deep/link", "scans/link", "scans/other/b", "scans/other/link", "scans/linked/f"}) {
    can_read("part", name);
    can_read("no such part", name);
  }
}

// Landlock has no rules for them.
TEST_F(Sandbox, TakesFilesOfTheKernelsOwnFileSystems) {
  const int in_memory = memfd_create("slice", MFD_CLOEXEC);
  const std::string name = "/proc/self/fd/" + std::to_string(in_memory);
  EXPECT_EXIT(
      {
        allow_reading_only({{name}, {}});
        _exit(access("/etc/passwd", F_OK) == 0 && open("/etc/passwd", O_RDONLY) < 0 ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
  close(in_memory);
}

// So the reader can do it, and it is the sandbox that refuses it.
TEST_F(Sandbox, IsWhatRefuses) {
  setenv("TAGRID_SANDBOX", "off", 1);
  EXPECT_EQ(sandbox_in_words(), "off");
  const Listener listener;
  const std::string other = file("elsewhere/secret", "secret");
  expect_done("write", path("scans/new"));
  for (const char* what : {"change", "truncate", "read"}) expect_done(what, other);
  expect_done("list", path("elsewhere"));
  expect_done("connect", listener.port());
  for (const char* what : {"talk", "broadcast", "signal"}) expect_done(what, "-");
  expect_done("start", "/bin/true");
}

}  // namespace
}  // namespace tagrid
