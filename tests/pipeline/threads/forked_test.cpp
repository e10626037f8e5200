#include <gtest/gtest.h>
#include <oneapi/tbb/parallel_for.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <vector>

#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

int sum_by(Threads& threads) {
  std::atomic<int> sum = 0;
  threads.run([&] { oneapi::tbb::parallel_for(0, 1000, [&](int i) { sum += i; }); });
  return sum;
}

// The memory of stacks that the C library reuses has other content then.
void overwrite_stacks(int count) {
  std::vector<std::thread> threads;
  std::atomic<int> running = 0;
  for (int i = 0; i < count; ++i)
    threads.emplace_back([&] {
      volatile unsigned char bytes[1 << 16];
      for (auto& byte : bytes) byte = 0xa5;
      for (++running; running < count;) std::this_thread::yield();
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(Threads, WorkInAProcessThatWasForkedWhileOthersSlept) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the thread sanitizer knows no threads in a forked process of several threads";
#endif
  constexpr int count = 8, expected = 1000 * 999 / 2;
  Threads threads(count);
  ASSERT_EQ(sum_by(threads), expected);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // until they sleep
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(60);
    overwrite_stacks(count);
    bool is_right = true;
    for (int i = 0; i < 10; ++i) {
      Threads own(count);
      is_right = is_right && own.count() == count && sum_by(own) == expected;
    }
    _exit(is_right ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(sum_by(threads), expected);
}

}  // namespace
}  // namespace tagrid
