// Runs of `encode --resume` that are ended in all ways and then continue.
#pragma once

#include <random>

#include "tests/support/failing_disk.h"

namespace tagrid {

inline constexpr int resumable = 75;

class ResumedRuns : public FailingDisk {
 protected:
  /// volume.nhdr, with many parts, and its result.
  void make_volume(const std::string& dims) {
    phantom("volume.nhdr", {"--dims", dims});
    expect_ok(tagrid(with({"encode", "volume.nhdr", "-o", "plain.tag"}, settings_)));
    plain_ = content("plain.tag");
    std::filesystem::remove(path("plain.tag"));
  }
  Arguments command(const Arguments& more = {}) const {
    return with(with({"encode", "volume.nhdr", "-o", "new.tag", "--resume"}, settings_), more);
  }

  /// A name never belongs to an incomplete file, and beside it there are only the record and temporary files.
  void expect_no_half_file() const {
    for (const std::string& name : names()) {
      if (name == "new.tag") {
        EXPECT_TRUE(content(name) == plain_) << "new.tag is not whole";
      }
      // A lock that a killed run left holds nobody up, and goes with the next run.
      EXPECT_TRUE(name == "new.tag" || name.starts_with("volume.") || name.starts_with(".new.tag.parts") ||
                  name == ".new.tag.lock")
          << name;
    }
  }
  /// The record is gone, and the result exists.
  void expect_result(const Ending& ending) const {
    EXPECT_EQ(ending.code, 0) << ending.err << ending.out;
    EXPECT_TRUE(content("new.tag") == plain_) << "new.tag is not what it is without interruptions";
    for (const std::string& name : names()) EXPECT_FALSE(name.starts_with(".new.tag")) << name << " is left";
  }
  void begin_anew() const {
    for (const std::string& name : names())
      if (!name.starts_with("volume.")) std::filesystem::remove_all(path(name));
  }
  /// The calls of a whole run with --resume, of which nothing is left.
  std::vector<Call> calls_of_command(const Arguments& more = {}) {
    Ending ending;
    const std::vector<Call> calls = calls_of({"", command(more)}, ending);
    EXPECT_EQ(ending.code, 0) << ending.err;
    begin_anew();
    return calls;
  }
  /// The same run, which is ended before its call of this number, from 1.
  Ending ended_at(std::size_t call, const std::string& kind, const Arguments& more = {}) {
    return run({"", command(more)}, std::to_string(call), kind);
  }
  std::vector<std::string> parts() const {
    std::vector<std::string> result;
    if (!std::filesystem::exists(path(".new.tag.parts"))) return result;
    for (const auto& entry : std::filesystem::directory_iterator(path(".new.tag.parts")))
      if (std::isdigit(entry.path().filename().string()[0])) result.push_back(entry.path().string());
    std::sort(result.begin(), result.end());
    return result;
  }
  /// A run that ends in the middle, with some parts complete.
  void make_record(const Arguments& more = {}) {
    const std::vector<Call> calls = calls_of_command(more);
    std::size_t at = 0;
    for (std::size_t renames = 0; renames < 5; ++at) renames += calls[at].name == "rename";
    ASSERT_EQ(ended_at(at, "SIGKILL", more).signal, SIGKILL);
    ASSERT_GE(parts().size(), 2U);
  }

  const Arguments settings_ = {"--cube=8", "--brick=1", "--max-error=2", "-T2"};
  std::string plain_;
};

}  // namespace tagrid
