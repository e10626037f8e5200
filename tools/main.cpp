// tagrid: CT volumes as one file, a conforming tetrahedral adaptive grid and every voxel within a bound.

#include <fmt/format.h>

#include <cstdio>
#include <new>
#include <vector>

#include "io/errors.h"
#include "tools/commands.h"
#include "tools/exit_codes.h"

namespace {

using namespace tagrid;

int fail(int code, const std::string& message) {
  fmt::print(stderr, "tagrid: {}\n", message);
  return code;
}

int run(int argc, char** argv) {
  CLI::App app{
      "CT volumes as one file: a conforming tetrahedral adaptive grid and every voxel within a bound",
      "tagrid"};
  app.set_version_flag("--version", "tagrid " TAGRID_VERSION);
  app.require_subcommand(1);
  app.set_help_flag("-h,--help", "Print this help and exit");
  std::vector<std::pair<CLI::App*, Action>> commands;
  for (auto* add : {add_encode_command, add_decode_command, add_info_command, add_verify_command,
                    add_mesh_command, add_phantom_command}) {
    Action action = add(app);
    commands.emplace_back(app.get_subcommands({}).back(), std::move(action));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    app.exit(error);
    return exit_usage;
  }
  for (const auto& [command, action] : commands)
    if (command->parsed()) action();
  return exit_ok;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    return fail(exit_usage, error.what());
  } catch (const BrokenInput& error) {
    return fail(exit_broken_input, error.what());
  } catch (const WorldError& error) {
    return fail(exit_world, error.what());
  } catch (const std::bad_alloc&) {
    return fail(exit_world, "out of memory; a smaller --brick, or fewer threads, need less");
  } catch (const std::exception& error) {
    return fail(exit_bug, fmt::format("this is a bug: {}", error.what()));
  }
}
