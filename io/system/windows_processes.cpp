// Programs that read formats are not on Windows yet: whoever asks for them is told.
#include <cerrno>

#include "io/system/processes.h"

namespace tagrid {
namespace {

class NoProcesses final : public Processes {
 public:
  StartedChild start(const std::string&, std::vector<std::string>, std::uint64_t) override {
    return {StartedChild::Failure::process, ENOSYS};
  }
  StartedChild ask_for_twin(const Child&, std::string_view) override {
    return {StartedChild::Failure::process, ENOSYS};
  }
  bool take_twin(int, std::uint64_t) override { return false; }
  int limit_memory(int, std::uint64_t) override { return ENOSYS; }
  ChildEnding ending(int, std::chrono::milliseconds) override { return {}; }
  void kill(int) override {}
};

int no_system_call() {
  errno = ENOSYS;
  return -1;
}

}  // namespace

Processes& processes_of_system() {
  static Processes& all = *new NoProcesses;
  return all;
}

std::ptrdiff_t receive_request(std::span<char>, TwinStreams&) { return no_system_call(); }
int start_twin(const TwinStreams&, std::FILE*) { return no_system_call(); }
std::string name_of_signal(int number) { return "signal " + std::to_string(number); }

}  // namespace tagrid
