#include "stages/picture/grey_window.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace tagrid {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity(),
                 nan = std::numeric_limits<double>::quiet_NaN(), most = std::numeric_limits<double>::max();

GreyWindow window(std::vector<double> values) { return window_of(values); }

TEST(GreyWindows, LeaveOutHalfAPercentAtEachEnd) {
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) values.push_back(i);
  std::ranges::shuffle(values, std::mt19937(1));
  const GreyWindow w = window(values);
  EXPECT_EQ(w.low, 5);
  EXPECT_EQ(w.high, 994);
}

TEST(GreyWindows, DoNotCountPaddingOrWhatIsNotFinite) {
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) values.push_back(i);
  for (int i = 0; i < 1001; ++i) values.push_back(-2000);
  for (int i = 0; i < 3000; ++i) values.insert(values.end(), {nan, inf, -inf});
  EXPECT_EQ(window(values).low, 5);
  values.erase(values.begin() + 1000, values.begin() + 1002);  // now it is not more than half
  EXPECT_EQ(window(values).low, -2000);
}

TEST(GreyWindows, OfAMaskOrLabelsShowTheBackgroundToo) {
  std::vector<double> mask(1000, 0.0), labels = mask;
  std::fill_n(mask.begin() + 3, 100, 255.0);
  GreyWindow window = window_of(mask);
  EXPECT_EQ(window.low, 0);
  EXPECT_EQ(window.high, 255);
  for (std::size_t i = 0; i < 300; ++i) labels[i] = static_cast<double>(1 + i % 3);
  window = window_of(labels);
  EXPECT_EQ(window.low, 0);
  EXPECT_EQ(window.high, 3);
}

TEST(GreyWindows, ArePossibleForAnyValues) {
  const auto expect_window = [](std::vector<double> values) {
    const GreyWindow w = window(values);
    RC_ASSERT(w.low < w.high);
    RC_ASSERT(std::isfinite(w.low) && std::isfinite(w.high));
    for (const double value : values) w.grey(value);
  };
  for (const auto& values : std::vector<std::vector<double>>{{},
                                                             {7},
                                                             {7, 7, 7},
                                                             {nan},
                                                             {inf, -inf},
                                                             {most},
                                                             {-most},
                                                             {-most, most},
                                                             {most, most, 1},
                                                             {0, -0.0}})
    expect_window(values);
  rc::check(expect_window);
}

TEST(GreyWindows, RunFromBlackToWhite) {
  const GreyWindow w{-1000, 1000};
  EXPECT_EQ(w.grey(-1000), 0);
  EXPECT_EQ(w.grey(-inf), 0);
  EXPECT_EQ(w.grey(0), 128);
  EXPECT_EQ(w.grey(1000), 255);
  EXPECT_EQ(w.grey(inf), 255);
  EXPECT_EQ(w.grey(nan), std::nullopt);
  EXPECT_EQ((GreyWindow{-most, most}.grey(0)), 128);
}

}  // namespace
}  // namespace tagrid
