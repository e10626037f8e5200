// Programs that read formats, and a server, are not on Windows yet: whoever asks for them is told.
#include <cerrno>

#include "io/system/processes.h"
#include "io/system/sockets.h"

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
std::ptrdiff_t send_bytes(int, std::span<const std::byte>) { return no_system_call(); }
void end_sending(int) {}

Descriptor open_local_port(int&) { return no_system_call(); }
Descriptor accept_connection(int) { return no_system_call(); }
void set_patience(int, std::chrono::seconds) {}
std::ptrdiff_t receive_bytes(int, std::span<char>) { return no_system_call(); }
void end_receiving(int) {}
void end_connection(int) {}

int wait_for(std::span<Awaited>, int) { return no_system_call(); }

}  // namespace tagrid
