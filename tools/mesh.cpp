#include "tools/commands.h"
namespace tagrid {
Action add_mesh_command(CLI::App& app) {
  app.add_subcommand("mesh", "");
  return [] {};
}
Action add_phantom_command(CLI::App& app) {
  app.add_subcommand("phantom", "");
  return [] {};
}
}  // namespace tagrid
