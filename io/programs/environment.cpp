#include "io/programs/environment.h"

#include <algorithm>
#include <string_view>

#include "io/system/this_process.h"

namespace tagrid {
namespace {

constexpr std::string_view passed_names[] = {"PATH",   "HOME",        "USER",         "LOGNAME",
                                             "LANG",   "LANGUAGE",    "TZ",           "TZDIR",
                                             "TMPDIR", "DCMDICTPATH", "CONDA_PREFIX", "VIRTUAL_ENV"};
constexpr std::string_view passed_beginnings[] = {"LC_", "LD_", "HDF5_", "TAGRID_", "PYTHON", "OMP_"};

bool is_passed_on(std::string_view name) {
  // Messages of the program should be the same everywhere.
  if (name == "LC_ALL") return false;
  return std::ranges::find(passed_names, name) != std::end(passed_names) || name.ends_with("SAN_OPTIONS") ||
         std::ranges::any_of(passed_beginnings,
                             [&](std::string_view begin) { return name.starts_with(begin); });
}

}  // namespace

std::vector<std::string> environment_of_programs() {
  std::vector<std::string> variables;
  for (std::string& text : environment())
    if (is_passed_on(std::string_view(text).substr(0, text.find('=')))) variables.push_back(std::move(text));
  variables.emplace_back("LC_ALL=C");
  return variables;
}

}  // namespace tagrid
