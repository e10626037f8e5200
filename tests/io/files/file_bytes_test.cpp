// Files that are read: bytes, lines, and the files that a directory shows.
#include <sys/stat.h>

#include <csignal>
#include <thread>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/held_files.h"
#include "io/files/slice_files.h"
#include "tests/support/memory_files.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

// Bytes of files and pipes: reading, peeking, skipping, lines.

class FileBytesTest : public TemporaryFolder {
 protected:
  static std::string text(std::size_t size) {
    std::string text;
    for (std::size_t i = 0; text.size() < size; ++i) text += std::to_string(i) + (i % 7 == 0 ? "\n" : " ");
    text.resize(size);
    return text;
  }
  static std::string read(FileBytes& bytes, std::size_t size) {
    std::string result(size, '?');
    result.resize(bytes.read(reinterpret_cast<std::byte*>(result.data()), size));
    return result;
  }
  /// Calls use(bytes, is_pipe) with the same bytes in a file and in a pipe.
  template <class Use>
  void in_file_and_pipe(const std::string& content, Use use) {
    FileBytes in_file(file("file", content));
    use(in_file, false);
    ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
    const std::jthread writer([&] {
      // In pieces of odd sizes. The reader may end first.
      signal(SIGPIPE, SIG_IGN);
      const int pipe = open(path("pipe").c_str(), O_WRONLY);
      for (std::size_t at = 0; at < content.size(); at += 997)
        if (write(pipe, content.data() + at, std::min<std::size_t>(997, content.size() - at)) < 0) break;
      close(pipe);
    });
    {
      FileBytes in_pipe(path("pipe"));
      use(in_pipe, true);
    }
    unlink(path("pipe").c_str());
  }
};

TEST_F(FileBytesTest, PeekingMovesNothing) {
  const std::string content = text(200'000);
  in_file_and_pipe(content, [&](FileBytes& bytes, bool is_pipe) {
    EXPECT_EQ(bytes.size().has_value(), !is_pipe);
    EXPECT_TRUE(bytes.peek(5) == content.substr(0, 5));
    EXPECT_TRUE(bytes.peek(FileBytes::peek_limit) == content.substr(0, FileBytes::peek_limit));
    EXPECT_EQ(bytes.position(), 0U);
    EXPECT_TRUE(read(bytes, 100'000) == content.substr(0, 100'000));
    EXPECT_TRUE(bytes.peek(9) == content.substr(100'000, 9));
    EXPECT_EQ(bytes.position(), 100'000U);
    EXPECT_EQ(bytes.skip(50'000), 50'000U);
    EXPECT_TRUE(read(bytes, 1'000'000) == content.substr(150'000)) << "less only at the end";
    EXPECT_EQ(read(bytes, 1), "");
    EXPECT_EQ(bytes.peek(1), "");
    EXPECT_EQ(bytes.skip(1), 0U);
  });
}

TEST_F(FileBytesTest, LinesHaveTheirEndsAndTheLastOneNone) {
  in_file_and_pipe("one\n\ntwo\r\nthree", [&](FileBytes& bytes, bool) {
    for (const std::string expected : {"one\n", "\n", "two\r\n", "three", ""}) {
      std::string line;
      EXPECT_TRUE(bytes.read_line(line, 100));
      EXPECT_EQ(line, expected);
    }
  });
}

TEST_F(FileBytesTest, ALineThatIsTooLongIsToldAndNotRead) {
  in_file_and_pipe(std::string(300'000, 'x') + "\n", [&](FileBytes& bytes, bool) {
    std::string line;
    EXPECT_FALSE(bytes.read_line(line, 100'000));
    EXPECT_LE(line.size(), 100'000U + FileBytes::peek_limit);
  });
}

TEST_F(FileBytesTest, SeekingGoesAnywhereInAFile) {
  const std::string content = text(100'000);
  FileBytes bytes(file("a", content));
  EXPECT_EQ(bytes.size(), 100'000U);
  for (const std::size_t at : {99'999U, 0U, 65'536U, 100'000U, 3U}) {
    bytes.seek(at);
    EXPECT_EQ(bytes.position(), at);
    EXPECT_TRUE(read(bytes, 10) == content.substr(at, 10));
  }
}

TEST_F(FileBytesTest, AReadThatWaitsForAPipeEndsWhenItIsStopped) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(write(ends[1], "abc", 3), 3);
  std::atomic<bool> stop{false};
  FileBytes bytes("/dev/fd/" + std::to_string(ends[0]));
  bytes.stop_when(stop);
  EXPECT_EQ(read(bytes, 3), "abc");
  std::jthread stopper([&] { stop = true; });
  EXPECT_THROW(read(bytes, 1), WorldError);
  close(ends[0]);
  close(ends[1]);
}

TEST_F(FileBytesTest, WhatCannotBeReadIsNamed) {
  EXPECT_THROW(FileBytes(path("none")), WorldError);
  const std::string message = message_of<std::runtime_error>([&] {
    FileBytes bytes(folder_.string());
    read(bytes, 1);
  });
  EXPECT_TRUE(has(message, folder_.string()));
}

// A file of lines is whole after every line, and has one writer.

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

/// Files of this test, whose syncs may fail.
class SyncsFail : public MemoryFiles {
 public:
  bool fails = false;
  bool sync(int file) override {
    if (!fails) return MemoryFiles::sync(file);
    errno = EIO;
    return false;
  }
};

TEST_F(LineFileTest, LaterLinesAreTakenBackIfTheyCannotBeMadeDurable) {
  SyncsFail memory;
  memory.add_folder("/memory");
  const FilesInstead instead(memory);
  LineFile lines("/memory/a");
  lines.append("one");
  lines.append_later("two");
  EXPECT_EQ(memory.content("/memory/a"), "one\ntwo\n");
  memory.fails = true;
  EXPECT_THROW(lines.sync(), WorldError);
  EXPECT_EQ(memory.content("/memory/a"), "one\n");
  memory.fails = false;
  lines.append_later("three");
  lines.sync();
  EXPECT_EQ(memory.content("/memory/a"), "one\nthree\n");
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
    EXPECT_THROW(LineFile(path("a")), HeldByAnother);
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

// The files of a directory that may be parts of a volume.

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
