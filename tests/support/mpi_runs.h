// Runs tagrid-mpi with many processes on this machine.
#pragma once

#include <filesystem>
#include <regex>

#include "tests/support/resumed_runs.h"

namespace tagrid {

class MpiRuns : public ResumedRuns {
 protected:
  void SetUp() override {
#ifndef TAGRID_MPI_PROGRAM
    GTEST_SKIP() << "tagrid-mpi was not built (-DTAGRID_MPI=ON)";
#else
    if (program_is_sanitized()) GTEST_SKIP() << "tagrid-mpi is not built with sanitizers";
    if (std::system("mpirun --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "there is no mpirun here";
#endif
  }
  static Arguments mpirun(int processes, const Arguments& more = {}) {
#ifdef TAGRID_MPI_PROGRAM
    const std::string program = TAGRID_MPI_PROGRAM;
#else
    const std::string program;
#endif
    // Open MPI 5 has no option to be quiet, and complains of TCP between processes of one machine if the
    // network is not the loopback.
    return with(with({"env", "OMPI_MCA_rmaps_base_oversubscribe=1", "OMPI_MCA_orte_execute_quiet=1",
                      "OMPI_MCA_btl_tcp_if_include=lo", "mpirun", "--allow-run-as-root", "--oversubscribe",
                      "-n", std::to_string(processes)},
                     more),
                {program});
  }
  Ending by(int processes, const Arguments& arguments, const Arguments& more = {}) const {
    Ending ending = Process(with(mpirun(processes, more), arguments), folder_.string()).finish();
    // Sometimes mpirun's event library complains of connections to ranks that have ended.
    ending.err = std::regex_replace(ending.err, std::regex("\\[warn\\] Epoll [^\n]*\n"), "");
    // Open MPI 5 says which rank failed first.
    ending.err = std::regex_replace(ending.err, std::regex("-+\nprterun detected [\\s\\S]*?\n-+\n"), "");
    return ending;
  }
  /// Whether a process works in the directory.
  bool is_somebody_here() const {
    std::error_code gone;  // processes that end while we look have no links
    const std::filesystem::path here = std::filesystem::canonical(folder_);
    for (const auto& process : std::filesystem::directory_iterator("/proc", gone))
      if (std::filesystem::read_symlink(process.path() / "cwd", gone) == here) return true;
    return false;
  }
  /// Waits for the processes of an mpirun that was killed: they live on until they notice.
  void wait_for_all_processes() const {
    for (int tries = 0; tries < 6000 && is_somebody_here(); ++tries) usleep(10000);
    EXPECT_FALSE(is_somebody_here());
  }
  void expect_names(const std::vector<std::string>& expected) const { EXPECT_EQ(names(), expected); }
  /// Expects an error that is reported once, whichever rank found it.
  static void expect_one_error(const Ending& ending, int code, std::string_view what) {
    EXPECT_EQ(ending.code, code) << ending.err;
    const std::size_t first = ending.err.find("tagrid: ");
    ASSERT_NE(first, std::string::npos) << ending.err;
    EXPECT_EQ(first, ending.err.rfind("tagrid: ")) << ending.err;
    EXPECT_TRUE(has(ending.err, what));
  }
  /// The disk of the second rank fails, or the rank is killed, at some call; with `lasting`, every later call
  /// fails, too.
  Ending with_fault(int processes, const std::string& at, const std::string& kind, const Arguments& arguments,
                    int victim = 1, bool lasting = false) const {
    const std::string script =
        "if [ \"$OMPI_COMM_WORLD_RANK\" = " + std::to_string(victim) +
        " ]; then export LD_PRELOAD=" TAGRID_FAULT_INJECTION " TAGRID_FAULT_FOLDER=" + folder_.string() +
        " TAGRID_FAULT_AT=" + at + " TAGRID_FAULT_KIND=" + kind +
        " TAGRID_FAULT_LASTING=" + (lasting ? "1" : "") +
        " ASAN_OPTIONS=verify_asan_link_order=0; fi; exec \"$0\" \"$@\"";
    Arguments command = mpirun(processes);
    command.insert(command.end() - 1, {"bash", "-c", script});
    return Process(with(command, arguments), folder_.string()).finish();
  }
};

}  // namespace tagrid
