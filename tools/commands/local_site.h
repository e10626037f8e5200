// What commands share that serve something on this machine until they are interrupted.
#pragma once

#include <CLI/CLI.hpp>
#include <csignal>
#include <string>

#include "io/files/system_call.h"

namespace tagrid {

/// 128 bits that nobody can guess, as hexadecimal digits. Throws WorldError.
std::string random_token();

/// The last part of the name or address of a file; "volume.tag" if it has none.
std::string name_of_input(const std::string& input);

/// --port
void add_port_option(CLI::App& command, int& port);

/// The end signals, which are kept from the process and can be read instead.
class EndSignals {
 public:
  /// Throws WorldError.
  EndSignals();
  int descriptor() const { return descriptor_; }
  /// What the process had before, for programs that it starts.
  const sigset_t& before() const { return before_; }
  /// From now on, a second one ends the process at once. REQUIRES: one can be read.
  void let_through();

 private:
  sigset_t set_, before_;
  Descriptor descriptor_;
};

}  // namespace tagrid
