#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "io/system/on_windows.h"
#include "io/system/processes.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

/// Our end of a pipe to or from a child. Windows cannot wait until a pipe has bytes, or room for them. It can wait for
/// the end of a call that has begun: so one is always going on, with bytes of the buffer here.
class EndOfPipe : public windows::Stream {
 public:
  explicit EndOfPipe(windows::Handle pipe)
      : pipe_(std::move(pipe)), done_(CreateEventW(nullptr, TRUE, TRUE, nullptr)) {}
  ~EndOfPipe() override { stop(); }
  EndOfPipe(const EndOfPipe&) = delete;
  EndOfPipe& operator=(const EndOfPipe&) = delete;

  HANDLE readiness() const override { return done_.get(); }

 protected:
  static constexpr std::size_t buffer_size = std::size_t{1} << 18;

  /// What begins with ReadFile() or WriteFile().
  template <class Call>
  void begin(Call call) {
    call_ = {};
    call_.hEvent = done_.get();
    goes_on_ = call(pipe_.get(), &call_) != 0 || GetLastError() == ERROR_IO_PENDING;
    has_failed_ = !goes_on_;
    if (has_failed_) SetEvent(done_.get());
  }
  /// The bytes of the call that has ended; nothing and EAGAIN if it goes on, ECANCELED if it has to begin again, or
  /// EPIPE if it failed.
  std::optional<std::size_t> ended() {
    DWORD count = 0;
    if (goes_on_ && GetOverlappedResult(pipe_.get(), &call_, &count, FALSE) == 0) {
      if (GetLastError() == ERROR_IO_INCOMPLETE) {
        errno = EAGAIN;
        return std::nullopt;
      }
      goes_on_ = false;
      // The end of a thread ends the calls that it began.
      if (GetLastError() == ERROR_OPERATION_ABORTED) {
        errno = ECANCELED;
        return std::nullopt;
      }
      has_failed_ = true;
    }
    goes_on_ = false;
    if (!has_failed_) return count;
    errno = EPIPE;
    return std::nullopt;
  }
  /// Waits for the end of a call, and closes the pipe.
  void finish(std::chrono::milliseconds most) {
    if (goes_on_) WaitForSingleObject(done_.get(), static_cast<DWORD>(most.count()));
    stop();
  }

  std::array<std::byte, buffer_size> buffer_;

 private:
  void stop() {
    DWORD count = 0;
    // The system must not write to the buffer after its end.
    if (goes_on_) {
      CancelIoEx(pipe_.get(), &call_);
      GetOverlappedResult(pipe_.get(), &call_, &count, TRUE);
    }
    goes_on_ = false;
    has_failed_ = true;
    pipe_.reset();
  }

  windows::Handle pipe_, done_;
  OVERLAPPED call_ = {};
  bool goes_on_ = false, has_failed_ = false;
};

class OutputOfChild final : public EndOfPipe {
 public:
  explicit OutputOfChild(windows::Handle pipe) : EndOfPipe(std::move(pipe)) { read_ahead(); }

  std::ptrdiff_t read(std::span<std::byte> to) override {
    if (rest_.empty()) {
      const auto count = ended();
      if (!count && errno == ECANCELED) {
        read_ahead();
        errno = EAGAIN;
      }
      // The other end was closed.
      if (!count) return errno == EAGAIN ? -1 : 0;
      rest_ = std::span(buffer_).first(*count);
    }
    const std::size_t size = std::min(to.size(), rest_.size());
    std::memcpy(to.data(), rest_.data(), size);
    rest_ = rest_.subspan(size);
    if (rest_.empty()) read_ahead();
    if (size > 0) return static_cast<std::ptrdiff_t>(size);
    errno = EAGAIN;
    return -1;
  }

 private:
  void read_ahead() {
    begin([this](HANDLE pipe, OVERLAPPED* call) {
      return ReadFile(pipe, buffer_.data(), static_cast<DWORD>(buffer_.size()), nullptr, call);
    });
  }

  std::span<const std::byte> rest_;  ///< of the buffer
};

class InputOfChild final : public EndOfPipe {
 public:
  using EndOfPipe::EndOfPipe;

  std::ptrdiff_t write(std::span<const std::byte> bytes) override {
    if (!ended()) return -1;
    const std::size_t size = std::min(bytes.size(), buffer_.size());
    std::memcpy(buffer_.data(), bytes.data(), size);
    begin([&](HANDLE pipe, OVERLAPPED* call) {
      return WriteFile(pipe, buffer_.data(), static_cast<DWORD>(size), nullptr, call);
    });
    return static_cast<std::ptrdiff_t>(size);
  }
  // As long as a silent program is waited for.
  void end_writing() override { finish(std::chrono::minutes(1)); }
};

/// A new pipe. If it cannot be made, its ends are empty, and errno says why.
struct Pipe {
  windows::Handle ours, childs;
};

Pipe make_pipe(bool is_input_of_child) {
  const std::string digits = windows::random_digits();
  if (digits.empty()) return {};
  std::wstring name = L"\\\\.\\pipe\\tagrid.";
  name.append(digits.begin(), digits.end());
  const DWORD way = is_input_of_child ? PIPE_ACCESS_OUTBOUND : PIPE_ACCESS_INBOUND;
  constexpr DWORD room = 1 << 20;
  const HANDLE ours =
      CreateNamedPipeW(name.c_str(), way | FILE_FLAG_OVERLAPPED | FILE_FLAG_FIRST_PIPE_INSTANCE,
                       PIPE_TYPE_BYTE | PIPE_REJECT_REMOTE_CLIENTS, 1, room, room, 0, nullptr);
  if (ours == INVALID_HANDLE_VALUE) return windows::fail(), Pipe{};
  Pipe pipe{windows::Handle(ours), nullptr};
  SECURITY_ATTRIBUTES inherited = {sizeof inherited, nullptr, TRUE};
  const HANDLE childs = CreateFileW(name.c_str(), is_input_of_child ? GENERIC_READ : GENERIC_WRITE, 0,
                                    &inherited, OPEN_EXISTING, 0, nullptr);
  if (childs == INVALID_HANDLE_VALUE) return windows::fail(), Pipe{};
  pipe.childs.reset(childs);
  return pipe;
}

/// The variables as Windows takes them: one after the other, each with a zero, and one zero more.
std::wstring block_of(const std::vector<std::string>& variables) {
  std::wstring block;
  for (const std::string& variable : variables) block += path_of(variable).native() + L'\0';
  return block + L'\0';
}

/// What a program is started with: it inherits these handles and no others, and is in this job from its beginning.
class Inheritance {
 public:
  Inheritance(std::array<HANDLE, 3> handles, HANDLE job) : handles_(handles), job_(job) {
    SIZE_T size = 0;
    InitializeProcThreadAttributeList(nullptr, 2, 0, &size);
    bytes_.resize(size);
    is_made_ = InitializeProcThreadAttributeList(list(), 2, 0, &size) != 0;
    const auto set = [this](DWORD_PTR attribute, void* value, SIZE_T size_of_value) {
      return UpdateProcThreadAttribute(list(), 0, attribute, value, size_of_value, nullptr, nullptr) != 0;
    };
    is_right_ = is_made_ && set(PROC_THREAD_ATTRIBUTE_HANDLE_LIST, handles_.data(), sizeof handles_) &&
                set(PROC_THREAD_ATTRIBUTE_JOB_LIST, &job_, sizeof job_);
    if (!is_right_) windows::fail();
  }
  ~Inheritance() {
    if (is_made_) DeleteProcThreadAttributeList(list());
  }
  Inheritance(const Inheritance&) = delete;
  Inheritance& operator=(const Inheritance&) = delete;

  /// Otherwise, errno says why not.
  bool is_right() const { return is_right_; }
  LPPROC_THREAD_ATTRIBUTE_LIST list() {
    return reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(bytes_.data());
  }

 private:
  std::array<HANDLE, 3> handles_;
  HANDLE job_;
  std::vector<std::byte> bytes_;
  bool is_made_ = false, is_right_ = false;
};

/// A job ends all its processes when its only handle is closed, as when this process ends.
bool set_limits(HANDLE job, std::uint64_t memory) {
  JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits = {};
  limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE |
                                            JOB_OBJECT_LIMIT_DIE_ON_UNHANDLED_EXCEPTION |
                                            JOB_OBJECT_LIMIT_JOB_MEMORY;
  limits.JobMemoryLimit = memory;
  return SetInformationJobObject(job, JobObjectExtendedLimitInformation, &limits, sizeof limits) != 0 ||
         windows::fail();
}

class SystemProcesses final : public Processes {
 public:
  StartedChild start(const std::string& program, std::vector<std::string> environment,
                     std::uint64_t memory) override {
    using Failure = StartedChild::Failure;
    Pipe input = make_pipe(true), output = make_pipe(false), errors = make_pipe(false);
    if (!input.childs || !output.childs || !errors.childs) return {Failure::pipe, errno};
    Running running;
    running.job.reset(CreateJobObjectW(nullptr, nullptr));
    if (!running.job || !set_limits(running.job.get(), memory)) return {Failure::process, errno};
    Inheritance inheritance({input.childs.get(), output.childs.get(), errors.childs.get()},
                            running.job.get());
    if (!inheritance.is_right()) return {Failure::process, errno};
    STARTUPINFOEXW how = {};
    how.StartupInfo.cb = sizeof how;
    how.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
    how.StartupInfo.hStdInput = input.childs.get();
    how.StartupInfo.hStdOutput = output.childs.get();
    how.StartupInfo.hStdError = errors.childs.get();
    how.lpAttributeList = inheritance.list();
    std::wstring line = L'"' + path_of(program).native() + L'"', block = block_of(environment);
    PROCESS_INFORMATION started = {};
    constexpr DWORD flags = CREATE_NO_WINDOW | CREATE_NEW_PROCESS_GROUP | CREATE_UNICODE_ENVIRONMENT |
                            EXTENDED_STARTUPINFO_PRESENT;
    // end_all() ends it, or it is not started.
    std::unique_lock lock(mutex_);
    if (windows::is_ending) {
      lock.unlock();
      Sleep(INFINITE);
    }
    if (CreateProcessW(windows::native(program).c_str(), line.data(), nullptr, nullptr, TRUE, flags,
                       block.data(), nullptr, &how.StartupInfo, &started) == 0) {
      windows::fail();
      return {Failure::program, errno};
    }
    CloseHandle(started.hThread);
    running.process.reset(started.hProcess);
    const int number = static_cast<int>(started.dwProcessId);
    running_[number] = std::move(running);
    return {Failure::none,
            0,
            {number, windows::add({.stream = std::make_unique<InputOfChild>(std::move(input.ours))}),
             windows::add({.stream = std::make_unique<OutputOfChild>(std::move(output.ours))}),
             windows::add({.stream = std::make_unique<OutputOfChild>(std::move(errors.ours))})}};
  }

  // Programs here do not say that they make twins.
  StartedChild ask_for_twin(const Child&, std::string_view) override {
    return {StartedChild::Failure::process, ENOSYS};
  }
  bool take_twin(int, std::uint64_t) override { return false; }

  int limit_memory(int process, std::uint64_t bytes) override {
    // Also counted here: stacks of threads, and what libraries have before they do anything.
    constexpr std::uint64_t unused = std::uint64_t{32} << 20;
    const Running* const found = find(process);
    return found == nullptr || set_limits(found->job.get(), bytes + unused) ? 0 : errno;
  }

  ChildEnding ending(int process, std::chrono::milliseconds most) override {
    const Running* const found = find(process);
    DWORD code = 0;
    if (found == nullptr ||
        WaitForSingleObject(found->process.get(), static_cast<DWORD>(most.count())) != WAIT_OBJECT_0 ||
        GetExitCodeProcess(found->process.get(), &code) == 0)
      return {};
    if (windows::is_ending) Sleep(INFINITE);  // so is this process, at once
    // So Windows says why it ended a program.
    constexpr DWORD least_error = 0xC0000000;
    if (code < least_error) return {ChildEnding::Kind::exit, static_cast<int>(code)};
    const int number = signal_of(code);
    return {ChildEnding::Kind::signal, number, number != SIGTERM};
  }

  void kill(int process) override {
    const Running* const found = find(process);
    if (found == nullptr) return;
    TerminateJobObject(found->job.get(), 1);
    WaitForSingleObject(found->process.get(), INFINITE);
    const std::lock_guard lock(mutex_);
    running_.erase(process);
  }

  void end_all() {
    const std::lock_guard lock(mutex_);
    for (const auto& [number, running] : running_) TerminateJobObject(running.job.get(), 1);
    constexpr DWORD patience = 2000;  // milliseconds
    for (const auto& [number, running] : running_) WaitForSingleObject(running.process.get(), patience);
  }

 private:
  struct Running {
    windows::Handle process, job;
  };

  /// What POSIX would have sent.
  static int signal_of(DWORD code) {
    if (code == STATUS_ACCESS_VIOLATION || code == STATUS_STACK_OVERFLOW || code == STATUS_IN_PAGE_ERROR)
      return SIGSEGV;
    if (code == STATUS_ILLEGAL_INSTRUCTION || code == STATUS_PRIVILEGED_INSTRUCTION) return SIGILL;
    if (code >= STATUS_FLOAT_DENORMAL_OPERAND && code <= STATUS_INTEGER_OVERFLOW) return SIGFPE;
    return code == STATUS_CONTROL_C_EXIT ? SIGTERM : SIGABRT;
  }
  const Running* find(int process) {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(process);
    return found == running_.end() ? nullptr : &found->second;
  }

  std::mutex mutex_;
  std::map<int, Running> running_;
};

}  // namespace

Processes& processes_of_system() {
  static Processes& all = *new SystemProcesses;
  return all;
}

void windows::end_programs() { static_cast<SystemProcesses&>(processes_of_system()).end_all(); }

std::string_view end_of_program_names() { return ".exe"; }
char separator_of_folders() { return ';'; }

std::string name_of_signal(int number) {
  return number == SIGSEGV   ? "Segmentation fault"
         : number == SIGFPE  ? "Floating point exception"
         : number == SIGILL  ? "Illegal instruction"
         : number == SIGABRT ? "Aborted"
                             : "Terminated";
}

std::ptrdiff_t receive_request(std::span<char> to, TwinStreams&) {
  return files_of_system().read(standard_input, std::as_writable_bytes(to));
}

bool can_start_twins() { return false; }

int start_twin(const TwinStreams&, std::FILE*) {
  errno = ENOSYS;
  return -1;
}

}  // namespace tagrid
