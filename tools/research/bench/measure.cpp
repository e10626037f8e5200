// bench_measure RESULT COMMAND [ARGUMENT...]
//
// Runs a command and writes one JSON object to the file RESULT: exit code, seconds by the clock, seconds of
// processor time (user and system) and peak resident memory in kB, of the command and of all processes that
// it waited for. The command's standard output is thrown away.
//
// A program of its own, and a small one: Linux counts the memory of the process that forks as memory of the
// new one, so what is started by an interpreter seems to need as much as the interpreter.

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>

namespace {

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

[[noreturn]] void become(char** command) {
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  dup2(nowhere, STDOUT_FILENO);
  execvp(command[0], command);
  std::perror(command[0]);
  _exit(127);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 3) {
    fmt::print(stderr, "usage: bench_measure RESULT COMMAND [ARGUMENT...]\n");
    return 64;
  }
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = fork();
  if (child < 0) {
    std::perror("bench_measure: fork");
    return 74;
  }
  if (child == 0) become(arguments + 2);
  int status = 0;
  rusage usage = {};
  wait4(child, &status, 0, &usage);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;

  std::FILE* result = std::fopen(arguments[1], "w");
  if (!result) {
    std::perror(arguments[1]);
    return 74;
  }
  fmt::print(result,
             "{{\"code\": {}, \"wall\": {:.6f}, \"user\": {:.6f}, \"system\": {:.6f}, \"peak_kb\": {}}}\n",
             WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), wall.count(),
             seconds(usage.ru_utime), seconds(usage.ru_stime), usage.ru_maxrss);
  return std::fclose(result) == 0 ? 0 : 74;
}
