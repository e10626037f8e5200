#include "tools/commands.h"
namespace tagrid {
Action add_phantom_command(CLI::App& app) {
  app.add_subcommand("phantom", "");
  return [] {};
}
}  // namespace tagrid
