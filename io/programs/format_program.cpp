#include "io/programs/format_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

constexpr std::string_view passed_names[] = {
    "PATH", "HOME", "USER", "LOGNAME", "LANG", "LANGUAGE", "TZ", "TZDIR", "TMPDIR", "DCMDICTPATH",
    "CONDA_PREFIX", "VIRTUAL_ENV",
    // Windows, and some of its libraries, start no program without these.
    "Path", "SystemRoot", "SYSTEMROOT", "TEMP", "TMP",
    // Where HDF5 looks for its plugins there; without it, that is the current directory.
    "ALLUSERSPROFILE"};
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

namespace {

using namespace std::chrono_literals;

using Steady = std::chrono::steady_clock;

constexpr std::size_t most_last_words = 2000;

}  // namespace

FormatProgram::FormatProgram(const std::string& program, const Limits& limits)
    : program_(program),
      limits_(limits),
      child_(taken(processes().start(program_, environment_of_programs(), limits_.memory))) {}

FormatProgram::FormatProgram(const std::string& program, Child twin, const Limits& limits)
    : program_(program), limits_(limits), child_(std::move(twin)) {
  if (!processes().take_twin(child_.process, limits_.memory)) {
    child_.process = -1;
    fail("gave a wrong number for its twin");
  }
}

FormatProgram::~FormatProgram() { end(); }

void FormatProgram::limit_memory(std::uint64_t bytes) {
  has_first_memory_ = false;
  if (const int error = processes().limit_memory(child_.process, bytes); error != 0)
    throw world_error("cannot limit its memory", program_, error);
}

Child FormatProgram::taken(StartedChild started) const {
  using Failure = StartedChild::Failure;
  if (started.failure == Failure::pipe)
    throw world_error("cannot make a pipe to it", program_, started.error);
  if (started.failure == Failure::process && started.error == EAGAIN)
    throw WorldError(
        program_ +
        ": cannot start a process for it, as there are too many; raise the limit on processes (ulimit -u)");
  if (started.failure == Failure::process)
    throw world_error("cannot start a process for it", program_, started.error);
  if (started.failure == Failure::program) throw world_error("cannot start it", program_, started.error);
  return std::move(started.child);
}

Child FormatProgram::ask_for_twin(std::string_view line) {
  return taken(processes().ask_for_twin(child_, std::string(line) + '\n'));
}

bool FormatProgram::wait(For what) {
  constexpr auto look_again = 100ms;
  // Time counts only while it waits: this process may have been stopped.
  for (Steady::duration silence = 0ms;;) {
    std::array<Awaited, 3> awaited = {{{what == For::input ? -1 : int{child_.output}},
                                       {what == For::output ? -1 : int{child_.input}, true},
                                       {child_.errors}}};
    const auto before = Steady::now();
    const int count = wait_for(awaited, static_cast<int>(look_again.count()));
    const auto waited = std::min<Steady::duration>(Steady::now() - before, look_again);
    if (stop_ != nullptr && *stop_) throw WorldError(program_ + ": its samples are no longer needed");
    if (count < 0 && errno != EINTR) throw world_error("cannot wait for it", program_, errno);
    if (count == 0) silence += waited;
    const bool answers = awaited[0].is_ready || awaited[1].is_ready;
    if (count > 0 && awaited[2].is_ready) {
      listen_to_errors();
      // Words on standard error are no answer: a program that says nothing else is silent.
      if (!answers) silence += waited;
    }
    if (count > 0 && answers) return awaited[0].is_ready;
    if (silence >= limits_.silence)
      fail(fmt::format("did not answer for {} seconds",
                       std::chrono::duration_cast<std::chrono::seconds>(limits_.silence).count()));
  }
}

void FormatProgram::listen_to_errors() {
  std::array<char, 4096> bytes;
  const std::ptrdiff_t count = files().read(child_.errors, std::as_writable_bytes(std::span(bytes)));
  if (count > 0) {
    last_words_.append(bytes.data(), static_cast<std::size_t>(count));
    if (last_words_.size() > most_last_words) last_words_.erase(0, last_words_.size() - most_last_words);
  } else if (count == 0) {
    child_.errors.reset();  // wait_for() passes over it
  }
}

void FormatProgram::say(std::string_view line) {
  std::string all(line);
  all += '\n';
  for (std::size_t said = 0; said < all.size();) {
    const std::ptrdiff_t count = send_bytes(child_.input, std::as_bytes(std::span(all)).subspan(said));
    if (count >= 0)
      said += static_cast<std::size_t>(count);
    else if (errno == EAGAIN)
      wait(For::input);
    else if (errno == EPIPE || errno == ECONNRESET)
      fail_as_ended();
    else
      throw world_error("cannot write to it", program_, errno);
  }
}

std::size_t FormatProgram::write(const std::byte* bytes, std::size_t size) {
  for (std::size_t sent = 0; sent < size;) {
    const std::ptrdiff_t count = send_bytes(child_.input, {bytes + sent, size - sent});
    bool has_ended = false;
    if (count >= 0)
      sent += static_cast<std::size_t>(count);
    else if (errno == EAGAIN)
      has_ended = wait(For::either) && !listen();
    else if (errno == EPIPE || errno == ECONNRESET)
      while (!has_line() && !has_ended) has_ended = !listen();
    else
      throw world_error("cannot write to it", program_, errno);
    if (count < 0 && has_line()) return sent;
    if (has_ended) fail_as_ended();
  }
  return size;
}

bool FormatProgram::listen() {
  if (heard_.size() > limits_.line) fail(fmt::format("gave an answer of more than {} bytes", limits_.line));
  std::array<std::byte, 16384> bytes;
  const std::size_t count = read_some(bytes.data(), bytes.size());
  heard_.append(reinterpret_cast<const char*>(bytes.data()), count);
  return count > 0;
}

std::size_t FormatProgram::read_some(std::byte* out, std::size_t size) {
  for (;;) {
    wait(For::output);
    const std::ptrdiff_t count = files().read(child_.output, {out, size});
    if (count >= 0) return static_cast<std::size_t>(count);
    if (errno != EAGAIN) throw world_error("cannot read from it", program_, errno);
  }
}

std::string FormatProgram::hear() {
  std::size_t searched = 0;
  for (;;) {
    const std::size_t end = heard_.find('\n', searched);
    if (end != heard_.npos) {
      std::string line = heard_.substr(0, end);
      heard_.erase(0, end + 1);
      return line;
    }
    searched = heard_.size();
    if (!listen()) fail_as_ended();
  }
}

void FormatProgram::read(std::byte* out, std::size_t size) {
  const std::size_t known = std::min(size, heard_.size());
  if (known > 0) std::memcpy(out, heard_.data(), known);
  heard_.erase(0, known);
  for (std::size_t done = known; done < size;) {
    const std::size_t count = read_some(out + done, size - done);
    if (count == 0) fail_as_ended();
    done += count;
  }
}

void FormatProgram::finish() {
  end_sending(child_.input);
  std::byte more;
  if (!heard_.empty() || read_some(&more, 1) > 0) fail("sent unexpected output");
  const ChildEnding how = ending();
  if (how.kind != ChildEnding::Kind::exit || how.number != 0) fail(in_words(how));
}

ChildEnding FormatProgram::ending() { return processes().ending(child_.process, 2s); }

std::string FormatProgram::in_words(const ChildEnding& ending) {
  switch (ending.kind) {
    case ChildEnding::Kind::none:
      break;
    case ChildEnding::Kind::exit:
      return fmt::format("exited with code {}", ending.number);
    case ChildEnding::Kind::signal:
      return fmt::format("was ended by signal {} ({})", ending.number, name_of_signal(ending.number));
  }
  return "closed its output but did not exit";
}

void FormatProgram::fail_as_ended() {
  const ChildEnding how = ending();
  const bool is_reading = !file_.empty() && is_reader_, is_signal = how.kind == ChildEnding::Kind::signal;
  fail(fmt::format("{} before it answered{}", in_words(how),
                   is_reading && is_signal ? "; the file may be damaged" : ""),
       true, is_reading && how.is_crash);
}

void FormatProgram::fail(std::string_view what, bool may_lack_memory, bool by_input) {
  for (int i = 0; i < 64 && child_.errors >= 0; ++i) {
    std::array<Awaited, 1> errors = {{{child_.errors}}};
    if (wait_for(errors, 0) <= 0) break;
    listen_to_errors();
  }
  while (last_words_.ends_with('\n')) last_words_.pop_back();
  std::string message = fmt::format("{}{}{}: {}", file_, file_.empty() ? "" : ": ", program_, what);
  if (!last_words_.empty()) message += fmt::format("; stderr: {}", last_words_);
  ErrorDetail detail;
  if (may_lack_memory && has_first_memory_ && limits_.memory < most_first_memory) {
    message += fmt::format("; it may have exceeded its limit of {} MiB", limits_.memory >> 20);
    detail.problem = Problem::program_memory;
  }
  if (by_input) throw BrokenInput(message, detail);
  throw WorldError(message, detail);
}

void FormatProgram::fail_for_memory(const std::string& message) const {
  if (!has_first_memory_) throw WorldError(message);  // it has what it asked for
  const std::string with_limit = fmt::format("{} ({} MiB)", message, limits_.memory >> 20);
  if (limits_.memory < most_first_memory) throw UsageError(with_limit, Problem::program_memory);
  throw WorldError(with_limit);
}

void FormatProgram::end() {
  for (Descriptor* end : {&child_.input, &child_.output, &child_.errors}) end->reset();
  if (child_.process < 0) return;
  // Its end of input asks it to end.
  ending();
  processes().kill(std::exchange(child_.process, -1));
}

}  // namespace tagrid
