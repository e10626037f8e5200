#include "io/http/object.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "io/errors/errors.h"
#include "io/http/answer.h"

namespace tagrid {
namespace {

using namespace std::chrono_literals;

const Waiting::Clock::time_point start{};

/// The second in which a server is given up that begins after `delay` and then sends `rate` bytes a second in steps of
/// `step`; -1 if it may send for an hour.
int given_up(const Patience& patience, int delay, double rate, int step = 1, std::size_t at_once = 1) {
  Waiting waiting(patience, start);
  for (int second = 0; second < 3600; ++second) {
    const int sent = second < delay ? 0 : (second - delay) / step * step;
    if (waiting.is_over(static_cast<std::size_t>(rate * sent), at_once, start + std::chrono::seconds(second)))
      return second;
  }
  return -1;
}

TEST(Waiting, WhoSendsTooLittleIsGivenUp) {
  unsetenv("TAGRID_HTTP_TIMEOUT");
  const Patience usual = patience_with_servers();
  EXPECT_EQ(given_up(usual, 3600, 0), 30);
  EXPECT_EQ(given_up(usual, 20, 120), 51);
  EXPECT_EQ(given_up(usual, 0, 3900), 31);
  // Little now and then.
  EXPECT_EQ(given_up(usual, 0, 120, 29), 59);
  // What came fast at first does not count later.
  Waiting waiting(usual, start);
  int end = 0;
  while (end < 100 && !waiting.is_over(2'000'000 + 100 * static_cast<std::size_t>(end), 1,
                                       start + std::chrono::seconds(end)))
    ++end;
  EXPECT_EQ(end, 60);
}

TEST(Waiting, SlowLinksAreNot) {
  const Patience usual = patience_with_servers();
  EXPECT_EQ(given_up(usual, 0, 16384), -1);
  EXPECT_EQ(given_up(usual, 29, 4200), -1);
  // Bursts, and eight requests that share a modem.
  EXPECT_EQ(given_up(usual, 0, 16384, 10), -1);
  EXPECT_EQ(given_up(usual, 0, 16384 / 8.0, 1, 8), -1);
}

TEST(Waiting, MoreSecondsAllowASlowerServer) {
  setenv("TAGRID_HTTP_TIMEOUT", "4", 1);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 120), 5);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 16384), -1);
  setenv("TAGRID_HTTP_TIMEOUT", "300", 1);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 500), -1);
  EXPECT_EQ(given_up(patience_with_servers(), 0, 100), 301);
  for (const char* wrong : {"0", "-1", "x", "1.5", "3601"}) {
    setenv("TAGRID_HTTP_TIMEOUT", wrong, 1);
    EXPECT_THROW(patience_with_servers(), UsageError);
  }
  unsetenv("TAGRID_HTTP_TIMEOUT");
}

TEST(Answer, HeadersHaveAnEnd) {
  std::byte bytes[10];
  const std::optional<ObjectVersion> version;
  const Address address;
  Answer answer(address, 0, bytes, version);
  bool goes_on = true;
  for (int line = 0; line < 100'000 && goes_on; ++line)
    goes_on = answer.take_header(line % 1000 == 0 ? "HTTP/1.1 302 Found\r\n"
                                                  : "X: " + std::string(100, 'x') + "\r\n");
  EXPECT_FALSE(goes_on);
  ASSERT_TRUE(answer.wrong());
  EXPECT_NE(answer.wrong()->what.find("headers"), std::string::npos);
}

}  // namespace
}  // namespace tagrid
