// tagrid view: shows a .tag file in a browser of this machine.

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/random.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/open_source.h"
#include "io/server/site.h"
#include "io/tag/file.h"
#include "io/text/addresses.h"
#include "pipeline/serving/serve.h"
#include "tools/commands/commands.h"
#include "tools/options/shared_options.h"
#include "tools/report/process.h"

extern char** environ;

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// 128 bits that nobody can guess, as hexadecimal digits.
std::string random_token() {
  std::array<unsigned char, 16> bytes;
  if (uninterrupted([&] { return getrandom(bytes.data(), bytes.size(), 0); }) !=
      static_cast<ssize_t>(bytes.size()))
    throw WorldError(fmt::format("the system gives no random numbers: {}", std::strerror(errno)));
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

/// Where the page of the viewer is: beside the program, or where it is installed.
fs::path viewer_folder() {
  std::error_code unknown;
  const fs::path program = fs::read_symlink("/proc/self/exe", unknown).parent_path();
  const std::array folders = {program / "viewer", program.parent_path() / "share/tagrid/viewer"};
  for (const fs::path& folder : folders)
    if (fs::exists(folder / "index.html", unknown) && fs::exists(folder / "decoder/worker.js", unknown))
      return folder;
  throw WorldError(fmt::format(
      "the page of the viewer is not installed (looked for in {} and {}); install the Debian package "
      "tagrid, which contains it, or make it with tools/install_packages.sh page and web/build.sh",
      folders[0].string(), folders[1].string()));
}

/// The end signals, which are kept from the process and can be read instead.
class EndSignals {
 public:
  EndSignals() {
    sigemptyset(&set_);
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set_, number);
    if (pthread_sigmask(SIG_BLOCK, &set_, &before_) == 0) descriptor_ = signalfd(-1, &set_, SFD_CLOEXEC);
    if (descriptor_ < 0)
      throw WorldError(fmt::format("signals cannot be waited for: {}", std::strerror(errno)));
  }
  int descriptor() const { return descriptor_; }
  /// What the process had before, for programs that it starts.
  const sigset_t& before() const { return before_; }
  /// From now on, a second one ends the process at once.
  void let_through() {
    signalfd_siginfo first;
    [[maybe_unused]] const auto taken = read(descriptor_, &first, sizeof first);
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

 private:
  sigset_t set_, before_;
  Descriptor descriptor_;
};

/// Opens an address in the browser that the user prefers. Returns false if no program does that.
bool open_browser(const std::string& address, const sigset_t& signals) {
  std::string program = "xdg-open", argument = address;
  std::array<char*, 3> arguments = {program.data(), argument.data(), nullptr};
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_t actions;
  posix_spawnattr_init(&attributes);
  // A group of its own: the signal that ends this program leaves the browser open.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setsigmask(&attributes, &signals);
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  pid_t process = 0;
  const int error = posix_spawnp(&process, program.c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  return error == 0;
}

struct ViewCommand {
  std::string input;
  int port = 0;
  bool no_browser = false, quiet = false;

  void execute() const {
    require_tag_input(input);
    if (input == "-") throw UsageError("standard input: only a file can be viewed; save it as one first");
    const std::shared_ptr<const ByteSource> file = open_source(input);
    // A file that cannot be shown is an error here, not in the page.
    static_cast<void>(TagBricks(file));

    const std::string token = random_token(), root = "/" + token + "/";
    WebSite site;
    const fs::path folder = viewer_folder();
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      const std::string name = entry.path().lexically_relative(folder).string();
      site.items[root + name] = {std::make_shared<FileSource>(entry.path().string()),
                                 std::string(media_type(name))};
    }
    site.items[root] = site.items.at(root + "index.html");
    const std::string path = "file/" + percent_encoded(shown_name());
    site.items[root + path] = {file, "application/octet-stream"};
    site.entrance = root + "?src=" + percent_encoded(path);
    site.ticket = "/" + random_token();

    EndSignals signals;
    const LocalPort opened = open_port(port);
    const std::string machine = fmt::format("http://127.0.0.1:{}", opened.number);
    std::cout << machine << site.entrance << std::endl;
    flush_standard_output();
    if (!no_browser && !open_browser(machine + site.ticket, signals.before()))
      say_line("tagrid: no browser was opened, because xdg-open is missing; open the address above");
    if (!quiet) say_line("tagrid: serves this machine only; Ctrl-C ends it");
    serve(opened, site, signals.descriptor());
    signals.let_through();
  }

  /// The last part of the name or address.
  std::string shown_name() const {
    const std::string name = fs::path(input.substr(0, input.find('?'))).filename().string();
    return name.empty() ? "volume.tag" : name;
  }
};

}  // namespace

Action add_view_command(CLI::App& app) {
  auto state = std::make_shared<ViewCommand>();
  CLI::App* command = app.add_subcommand("view", "Show the slices in a browser on this machine");
  add_tag_input(*command, state->input, ".tag file or its address, not a pipe")->required();
  command->add_option("--port", state->port, "Port of 127.0.0.1; 0, the default, means one that is free")
      ->option_text("N")
      ->check(CLI::Range(0, 65535));
  command->add_flag("--no-browser", state->no_browser, "Only print the address");
  command->add_flag("-q,--quiet", state->quiet, "Print only the address and errors");
  return [state](Ranks&) { state->execute(); };
}

}  // namespace tagrid
