// What the commands on an archive have in common.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/catalogue/catalogue.h"
#include "tools/options/shared_options.h"

namespace tagrid {

struct ArchiveCommand {
  std::string folder;
  std::vector<std::string> wanted;  ///< conditions and names
  std::string keys;                 ///< the key file of an archive without names; "": none
  RunOptions run;

  /// The catalogue, after warnings on what is not in order, with the names of the key file. Throws WorldError.
  Catalogue opened() const;
  /// The volumes that are wanted. Throws UsageError if conditions and names are given, and there is none.
  std::vector<CatalogueEntry> matching(const Catalogue& catalogue) const;
  /// The same. Throws UsageError also if `wanted` is empty. `command` is for its message.
  std::vector<CatalogueEntry> named(const Catalogue& catalogue, const char* command) const;
};

/// Adds --keys.
void add_keys_option(CLI::App& command, ArchiveCommand& state);

/// Adds `tagrid archive NAME`, with the directory and, if it `takes_wanted`, conditions and names.
CLI::App* add_archive_action(CLI::App& app, ArchiveCommand& state, const std::string& name,
                             const std::string& help, bool takes_wanted = true);

}  // namespace tagrid
