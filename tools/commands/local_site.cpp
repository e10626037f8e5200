#include "tools/commands/local_site.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/random.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/files/system_call.h"
#include "io/text/addresses.h"
#include "pipeline/serving/serve.h"

namespace tagrid {

std::string random_token() {
  std::array<unsigned char, 16> bytes;
  if (uninterrupted([&] { return getrandom(bytes.data(), bytes.size(), 0); }) !=
      static_cast<ssize_t>(bytes.size()))
    throw WorldError(fmt::format("the system gives no random numbers: {}", std::strerror(errno)));
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

std::string name_of_input(const std::string& input) {
  const std::string name =
      std::filesystem::path(is_address(input) ? input.substr(0, input.find('?')) : input).filename().string();
  return name.empty() ? "volume.tag" : name;
}

void add_port_option(CLI::App& command, int& port) {
  command.add_option("--port", port, "Port of 127.0.0.1; 0, the default, means one that is free")
      ->option_text("N")
      ->check(CLI::Range(0, 65535));
}

namespace {

/// The end signals, which are kept from the process and can be read instead.
class EndSignals {
 public:
  /// Throws WorldError.
  EndSignals();
  int descriptor() const { return descriptor_; }
  /// What the process had before.
  const sigset_t& before() const { return before_; }
  /// From now on, a second one ends the process at once. REQUIRES: one can be read.
  void let_through();

 private:
  sigset_t set_, before_;
  Descriptor descriptor_;
};

EndSignals::EndSignals() {
  sigemptyset(&set_);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set_, number);
  if (pthread_sigmask(SIG_BLOCK, &set_, &before_) == 0) descriptor_ = signalfd(-1, &set_, SFD_CLOEXEC);
  if (descriptor_ < 0)
    throw WorldError(fmt::format("signals cannot be waited for: {}", std::strerror(errno)));
}

void EndSignals::let_through() {
  signalfd_siginfo first;
  [[maybe_unused]] const auto taken = read(descriptor_, &first, sizeof first);
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

}  // namespace

void serve_until_interrupted(
    const WebSite& site, int port,
    const std::function<void(const std::string& machine, const sigset_t& before)>& opened) {
  EndSignals signals;
  const LocalPort local = open_port(port);
  opened(fmt::format("http://127.0.0.1:{}", local.number), signals.before());
  serve(local, site, signals.descriptor(), [&] { signals.let_through(); });
}

}  // namespace tagrid
