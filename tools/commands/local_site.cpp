#include "tools/commands/local_site.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/system/this_process.h"
#include "io/text/addresses.h"
#include "io/text/paths.h"
#include "pipeline/serving/serve.h"

namespace tagrid {

std::string random_token() {
  std::array<unsigned char, 16> bytes;
  if (!fill_with_random(bytes))
    throw WorldError("the system gives no random numbers: {}", std::strerror(errno));
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

std::string name_of_input(const std::string& input) {
  const std::string name = name_of_path(is_address(input) ? input.substr(0, input.find('?')) : input);
  return name.empty() ? "volume.tag" : name;
}

void add_port_option(CLI::App& command, int& port) {
  command.add_option("--port", port, "Port of 127.0.0.1; 0, the default: a free one")
      ->option_text("N")
      ->check(CLI::Range(0, 65535));
}

LocalSite::LocalSite(int port) : port_(open_port(port)) {}

std::string LocalSite::machine() const { return fmt::format("http://127.0.0.1:{}", port_.number); }

void LocalSite::serve_until_interrupted(const WebSite& site) {
  serve(port_, site, signals_.descriptor(), [&] { signals_.let_through(); });
}

}  // namespace tagrid
