// A directory for the files of one test, removed at its end.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "io/system/files.h"

namespace tagrid {

class TemporaryFolder : public ::testing::Test {
 protected:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tagrid-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create " + name);
    folder_ = name;
  }
  ~TemporaryFolder() override {
    std::error_code ignored;
    std::filesystem::permissions(folder_, std::filesystem::perms::owner_all, ignored);
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string path(std::string_view name) const { return (folder_ / name).string(); }

  /// Writes a file, and returns its path.
  std::string file(std::string_view name, std::string_view bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

  std::string content(std::string_view name) const {
    std::ifstream in(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  /// The names in the directory, sorted.
  std::vector<std::string> names() const { return names_in(""); }
  std::vector<std::string> names_in(std::string_view folder) const {
    std::vector<std::string> result;
    for (const auto& entry : std::filesystem::directory_iterator(path(folder)))
      result.push_back(entry.path().filename().string());
    std::sort(result.begin(), result.end());
    return result;
  }

  /// True if files that killed runs left can be told from files in use; see io/files/temporaries.h.
  bool is_on_local_file_system() const {
    const int descriptor = open(folder_.c_str(), O_RDONLY);
    const bool local = files().is_local(descriptor);
    close(descriptor);
    return local;
  }

  std::filesystem::path folder_;
};

/// A pipe that holds `bytes` (less than 64 KiB) and then ends, under a path that can be opened.
class FilledPipe {
 public:
  explicit FilledPipe(std::string_view bytes) {
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    const auto written = write(ends[1], bytes.data(), bytes.size());
    close(ends[1]);
    end_ = ends[0];
    if (written != static_cast<ssize_t>(bytes.size())) throw std::runtime_error("the pipe is too small");
  }
  ~FilledPipe() { close(end_); }
  FilledPipe(const FilledPipe&) = delete;
  FilledPipe& operator=(const FilledPipe&) = delete;
  std::string path() const { return "/dev/fd/" + std::to_string(end_); }

 private:
  int end_;
};

/// The message of the exception that `action` throws, if it is an `Expected`; anything else is a failure.
template <class Expected, class Action>
std::string message_of(Action&& action) {
  try {
    action();
  } catch (const Expected& e) {
    return e.what();
  } catch (const std::exception& e) {
    ADD_FAILURE() << "another exception: " << e.what();
    return {};
  }
  ADD_FAILURE() << "no exception";
  return {};
}

/// Whether a text has another one in it, for EXPECT_TRUE and EXPECT_FALSE: a failure shows both.
inline testing::AssertionResult has(std::string_view text, std::string_view part) {
  const bool found = text.find(part) != text.npos;
  return (found ? testing::AssertionSuccess() : testing::AssertionFailure())
         << '"' << part << "\" in this text: " << text;
}

}  // namespace tagrid
