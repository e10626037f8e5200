#include "tools/commands.h"
namespace tagrid {
Action add_mesh_command(CLI::App& app) {
  app.add_subcommand("mesh", "");
  return [] {};
}
}  // namespace tagrid
