#include "io/programs/serve.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "io/errors/errors.h"
#include "io/system/processes.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

std::FILE* answers = stdout;
TwinStreams twin_streams;

}  // namespace

std::optional<std::string> next_request() {
  static std::string received;
  for (std::size_t searched = 0;;) {
    if (const std::size_t end = received.find('\n', searched); end != received.npos) {
      std::string line = received.substr(0, end);
      received.erase(0, end + 1);
      return line;
    }
    searched = received.size();
    std::array<char, 4096> bytes;
    const std::ptrdiff_t count = receive_request(bytes, twin_streams);
    if (count <= 0) return std::nullopt;
    received.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

bool is_new_twin() {
  const TwinStreams streams = std::exchange(twin_streams, {});
  const int process = streams.errors < 0 ? -1 : start_twin(streams, answers);
  if (process < 0) say({{"answer", "unknown"}});
  if (process > 0) say({{"answer", "twin"}, {"process", process}});
  return process == 0;
}

void begin_to_answer() {
  // Without it, prints of libraries would be wrong answers, which tagrid notices.
  if (std::FILE* file = divert_standard_output(); file != nullptr) answers = file;
}

void say(const OrderedJson& answer) {
  const std::string line = answer.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + '\n';
  std::fwrite(line.data(), 1, line.size(), answers);
  std::fflush(answers);
}

void say_samples(const std::vector<std::byte>& samples) {
  std::fwrite(samples.data(), 1, samples.size(), answers);
}

void flush_samples() { std::fflush(answers); }

void say_error(const std::exception_ptr& exception, const std::string& path, const std::string& of_memory) {
  SortedError error = sorted_error(exception);
  const bool lacks_memory =
      error.kind == ErrorKind::memory || error.detail.problem == Problem::program_memory;
  if (error.kind == ErrorKind::memory) error.message = path + ": " + of_memory;
  const char* kind = error.kind == ErrorKind::usage          ? "usage"
                     : error.kind == ErrorKind::broken_input ? "input"
                                                             : "world";
  OrderedJson answer = {{"answer", "error"}, {"kind", kind}, {"message", error.message}};
  if (error.detail.problem == Problem::slices_missing) answer["option"] = "gaps-ok";
  if (lacks_memory) answer["option"] = "memory";
  say(answer);
}

void say_working() {
  using Clock = std::chrono::steady_clock;
  static Clock::time_point last = Clock::now();
  if (Clock::now() - last < std::chrono::seconds(1)) return;
  last = Clock::now();
  say({{"answer", "working"}});
}

}  // namespace tagrid
