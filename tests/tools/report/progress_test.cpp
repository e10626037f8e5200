#include "tools/report/progress.h"

#include <gtest/gtest.h>

namespace tagrid {
namespace {

using namespace std::chrono_literals;

TEST(Progress, PlainIsALineAMinuteWithRateAndRemainingTime) {
  testing::internal::CaptureStderr();
  {
    ProgressMeter meter(ProgressStyle::plain, false, "encode", 1000000);
    const auto start = ProgressMeter::Clock::now();
    // A quarter of an hour for 1500 MB, ten updates a second.
    for (int tenth = 0; tenth <= 3050; ++tenth)
      meter.update(static_cast<std::uint64_t>(tenth) / 6, 1500, start + tenth * 100ms);
  }
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5) << text;
  EXPECT_EQ(text.substr(0, text.find('\n')), "encode   7 %  1.7 MB/s  14:00 left");
}

TEST(Progress, WorkThatIsDoneAgainHasATimeOfItsOwn) {
  testing::internal::CaptureStderr();
  {
    ProgressMeter meter(ProgressStyle::plain, false, "try", 1000000);
    const auto start = ProgressMeter::Clock::now();
    meter.update(1000, 1000, start + 30s);
    meter.update(0, 1000, start + 10min);
    meter.update(250, 1000, start + 12min);
    meter.begin(start + 20min);
    meter.update(500, 1000, start + 21min);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "try   0 %  0.0 MB/s  ? left\ntry  25 %  2.1 MB/s  6:00 left\ntry  50 %  8.3 MB/s  1:00 left\n");
}

TEST(Progress, QuietOrNoneSaysNothing) {
  testing::internal::CaptureStderr();
  const auto later = ProgressMeter::Clock::now() + 1h;
  ProgressMeter(ProgressStyle::none, false, "encode", 1).update(1, 2, later);
  ProgressMeter(ProgressStyle::plain, true, "encode", 1).update(1, 2, later);
  ProgressMeter(ProgressStyle::bar, true, "encode", 1).update(1, 2, later);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace tagrid
