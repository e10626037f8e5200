// A reader program for tests. Its files say the size of a volume and how it is read: "5 4 3 any". Sample
// number i of the volume is i. Instead of "any", "broken" means that slice 2 cannot be read, and "greedy"
// that the description takes 200 MiB. "tries" is followed by what else the reader tries, such as "write
// /tmp/x"; the pair "outcome" says what came of it.

#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <thread>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/programs/serve_reader.h"

namespace tagrid {
namespace {

int connect_to(const std::string& port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(port)));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return socket < 0 ? -1 : connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address);
}

int start(const std::string& program) {
  const pid_t child = fork();
  int status = 0;
  if (child > 0) return waitpid(child, &status, 0) == child && status == 0 ? 0 : -1;
  if (child < 0) return -1;
  execl(program.c_str(), program.c_str(), nullptr);
  _exit(127);
}

int attempt(const std::string& what, const std::string& at) {
  if (what == "read") return open(at.c_str(), O_RDONLY);
  if (what == "list") return open(at.c_str(), O_RDONLY | O_DIRECTORY);
  if (what == "write") return open(at.c_str(), O_WRONLY | O_CREAT, 0600);
  if (what == "change") return open(at.c_str(), O_RDWR);
  if (what == "truncate") return truncate(at.c_str(), 0);
  if (what == "remove") return unlink(at.c_str());
  if (what == "rename") return rename(at.c_str(), (at + ".new").c_str());
  if (what == "connect") return connect_to(at);
  if (what == "talk") return socket(AF_UNIX, SOCK_STREAM, 0);
  if (what == "broadcast") return socket(AF_INET, SOCK_DGRAM, 0);
  if (what == "start") return start(at);
  if (what == "become") return execl(at.c_str(), at.c_str(), nullptr);
  if (what == "signal") return kill(getppid(), 0);
  errno = EINVAL;
  return -1;
}

std::string outcome_of(const std::string& what, const std::string& at) {
  return attempt(what, at) < 0 ? std::strerror(errno) : "done";
}

class Ramp final : public ServedVolume {
 public:
  explicit Ramp(const std::string& path) {
    std::string order;
    std::ifstream file(path);
    if (!(file >> dims.x >> dims.y >> dims.z >> order)) throw BrokenInput(path + ": is no ramp");
    type = SampleType::uint32;
    files = {path};
    any_order = order != "next";
    is_broken_ = order == "broken";
    if (order == "greedy") much_.resize(std::size_t{200} << 20);
    pairs = {{"made by", "ramp"}};
    if (std::string what, at; order == "tries" && file >> what >> at) {
      pairs.emplace_back("outcome", outcome_of(what, at));
      // A thread that is made later is no way out.
      std::thread([&] { pairs.emplace_back("outcome of a thread", outcome_of(what, at)); }).join();
    }
    geometry.spacing = {1, 2, 3};
    geometry.has_spacing = true;
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    if (!any_order && z != next_) throw BrokenInput("slice " + std::to_string(z) + " is not the next one");
    if (is_broken_ && z == 2) throw BrokenInput("slice 2 cannot be read");
    next_ = z + 1;
    for (std::int64_t i = 0; i < dims.x * dims.y; ++i)
      store_little_endian(out + i * 4, static_cast<std::uint32_t>(z * dims.x * dims.y + i));
  }

 private:
  std::vector<std::byte> much_;
  bool is_broken_ = false;
  std::int64_t next_ = 0;
};

}  // namespace
}  // namespace tagrid

int main() {
  const tagrid::FilesBeside beside = {.may_need = [](auto, auto other) { return other.ends_with(".ramp"); },
                                      .are_listed = true};
  const auto open = [](const std::string& path,
                       const tagrid::ReaderOptions& options) -> std::unique_ptr<tagrid::ServedVolume> {
    const auto series = options.find("series");
    if (series == options.end()) return std::make_unique<tagrid::Ramp>(path);
    const std::vector<tagrid::Choice> list = {{"a", "the first"}, {"b", "the second"}, {"a", "the third"}};
    tagrid::chosen(path, "series", series->second == "all" ? "" : series->second, list);
    return std::make_unique<tagrid::Ramp>(path);
  };
  return tagrid::serve_volumes("ramp", open, beside, [] {});
}
