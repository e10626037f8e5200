// Bytes of files and pipes: reading, peeking, skipping, lines.
#include "io/files/file_bytes.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

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
  try {
    FileBytes bytes(folder_.string());
    read(bytes, 1);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(folder_.string()), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tagrid
