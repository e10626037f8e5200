// tagrid: stores a CT volume in one file, as an adaptive tetrahedral grid and every voxel within a bound.

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <vector>

#include "io/errors/errors.h"
#include "io/system/this_process.h"
#include "io/text/addresses.h"
#include "tools/commands/commands.h"
#include "tools/options/command_line.h"
#include "tools/options/shared_options.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"
#ifdef TAGRID_MPI
#include "pipeline/parts/work_orders.h"
#include "pipeline/ranks/mpi/mpi_ranks.h"
#include "tools/archive/conversion.h"
#endif

namespace {

using namespace tagrid;

#ifdef TAGRID_MPI
constexpr const char* version = "tagrid " TAGRID_VERSION " with MPI";
#else
constexpr const char* version = "tagrid " TAGRID_VERSION;
#endif

int fail(int code, const std::string& message) {
  say_line("tagrid: " + message);
  return code;
}

int fail(const Failure& failure) {
  if (!failure.message.empty()) fail(failure.code, failure.message);
  for (const std::string& line : failure.list) say_line("  " + line);
  return failure.code;
}

/// The arguments in reverse order, as CLI11 wants them. `help COMMAND` is `COMMAND --help`, as in git.
std::vector<std::string> reversed(std::vector<std::string> arguments, const CLI::App& app) {
  if (!arguments.empty() && arguments.front() == "help") {
    arguments.erase(arguments.begin());
    const auto is_asked_for = [&](const CLI::App* command) { return command->check_name(arguments.front()); };
    // A command that does not exist is left to be an error.
    if (arguments.empty() || !app.get_subcommands(is_asked_for).empty()) arguments.push_back("--help");
  }
  return {arguments.rbegin(), arguments.rend()};
}

int run_command(Ranks& ranks, const std::vector<std::string>& arguments) {
  CLI::App app{
      "Compress CT volumes: every voxel within a bound, and an adaptive tetrahedral mesh in the same file",
      "tagrid"};
  app.allow_windows_style_options(false);  // /scans is a path there, too
  const auto commands = add_commands(app, version);
  for (const std::string_view argument : arguments) {
    // Any message may quote an argument, such as one too many.
    for (const std::string_view text : {argument, argument.substr(argument.find('=') + 1)})
      if (is_address(text) || is_unknown_address(std::string(text)))
        show_instead_of(std::string(text), shown_address(text));
    if (argument.empty() || (argument.starts_with("--") && argument.ends_with('=')))
      throw UsageError("an argument is empty; is a shell variable unset?");
  }
  try {
    app.parse(reversed(arguments, app));
  } catch (const CLI::Success& success) {
    app.exit(success);
    std::cout.flush();
    flush_standard_output();
    return exit_ok;
  } catch (const CLI::ParseError& error) {
    return fail(exit_usage, explain(app, error));
  }
  for (const auto& [command, action] : commands) {
    if (!command->parsed()) continue;
    try {
      action(ranks);
    } catch (const std::exception&) {
      return fail(current_failure(memory_advice(*command)));
    }
  }
  flush_standard_output();
  return exit_ok;
}

/// Runs the program, and turns any exception into an exit code.
int guarded_run(Ranks& ranks, const std::vector<std::string>& arguments) {
  try {
    return run_command(ranks, arguments);
  } catch (const std::exception&) {
    return fail(current_failure());
  }
}

#ifndef TAGRID_MPI
/// Processes of this program do not work together, even if mpirun starts them together.
void tell_of_mpi(int code) {
  const char* count = std::getenv("OMPI_COMM_WORLD_SIZE");
  if (code != exit_ok && count != nullptr && std::string_view(count) != "1")
    say_line(
        "tagrid: mpirun started several processes of tagrid, which do not work together; start tagrid-mpi "
        "instead");
}
#else
/// Rank 0 runs the program and prints all messages; the other ranks carry out its orders.
int run_with_mpi(const std::vector<std::string>& arguments) {
  int code = exit_bug;
  std::unique_ptr<Ranks> ranks;
  try {
    ranks = start_mpi();
    // Called after MPI has started, because MPI installs handlers of its own.
    catch_signals();
    if (ranks->rank() > 0) {
      code =
          serve(*ranks, give_back_freed_memory, [&](const Bytes& order) { obey_conversion(*ranks, order); });
    } else {
      code = guarded_run(*ranks, arguments);
      dismiss(*ranks, code);
    }
  } catch (const std::exception& error) {
    fail(exit_bug, fmt::format("rank {}: this is a bug: {}; please report it", ranks ? ranks->rank() : 0,
                               error.what()));
    abort_mpi(exit_bug);
  }
  return code;
}
#endif

}  // namespace

int main(int argc, char** argv) {
  // A run sets its own number of threads, and -T may ask for more threads than the machine has cores.
  const oneapi::tbb::global_control threads(oneapi::tbb::global_control::max_allowed_parallelism,
                                            static_cast<std::size_t>(most_threads));
  keep_freed_memory();
  occupy_standard_streams();
  const std::vector<std::string> arguments = arguments_of_program(argc, argv);
#ifdef TAGRID_MPI
  return run_with_mpi(arguments);
#else
  catch_signals();
  Ranks alone;
  const int code = guarded_run(alone, arguments);
  tell_of_mpi(code);
  return code;
#endif
}
