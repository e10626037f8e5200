// What commands share that serve something on this machine until they are interrupted.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "io/server/site.h"
#include "io/system/signals.h"

namespace tagrid {

/// 128 bits that nobody can guess, as hexadecimal digits. Throws WorldError.
std::string random_token();

/// The last part of the name or address of a file; "volume.tag" if it has none.
std::string name_of_input(const std::string& input);

/// --port
void add_port_option(CLI::App& command, int& port);

/// An open port of this machine. While it exists, end signals wait for it.
class LocalSite {
 public:
  /// Throws WorldError.
  explicit LocalSite(int port);

  /// The beginning of the site's addresses: "http://127.0.0.1:8080".
  std::string machine() const;
  /// For programs that are started.
  const EndSignals& signals() const { return signals_; }
  /// Serves the site to this machine until the first end signal; a second one ends the process at once. Throws
  /// WorldError.
  void serve_until_interrupted(const WebSite& site);

 private:
  EndSignals signals_;
  LocalPort port_;
};

}  // namespace tagrid
