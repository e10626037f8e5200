#include "io/system/processes.h"

#include <utility>

namespace tagrid {
namespace {

Processes* processes_instead = nullptr;

}  // namespace

Processes& processes() { return processes_instead != nullptr ? *processes_instead : processes_of_system(); }

ProcessesInstead::ProcessesInstead(Processes& processes)
    : before_(std::exchange(processes_instead, &processes)) {}
ProcessesInstead::~ProcessesInstead() { processes_instead = before_; }

}  // namespace tagrid
