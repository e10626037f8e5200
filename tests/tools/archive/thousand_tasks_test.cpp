// A thousand tasks on one list, as arrays of a cluster start them: of different numbers of shards, encoding and
// removing originals at once, on machines whose clocks are hours apart, some started twice, some killed at any call on
// a file and started again. The files are in memory, and tasks take turns at these calls as a seed decides.
#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <iostream>
#include <list>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "tests/support/memory_files.h"
#include "tools/archive/record_line.h"
#include "tools/commands/commands.h"
#include "tools/report/failure.h"

namespace tagrid {
namespace {

using Words = std::vector<std::string>;

struct Task;
/// The task that this thread belongs to; nullptr: none.
thread_local Task* this_task = nullptr;

/// One start of a job.
struct Task {
  std::size_t job = 0;
  Words words;
  std::size_t dies_at = 0;  ///< the number of its last call, from 1; 0: it is not killed
  std::time_t skew = 0;     ///< of the clock of its machine, in seconds
  std::string host;

  std::size_t calls = 0;
  bool is_dead = false, has_ended = false;
  std::set<int> opened;
  Failure failure = {};
  std::thread thread = {};
};

/// Runs a command in this process.
Failure run(const Words& words) {
  CLI::App app("", "tagrid");
  Action action = add_convert_command(app);
  app.parse(Words(words.rbegin(), words.rend()));
  try {
    Ranks alone;
    action(alone);
  } catch (const std::exception&) {
    return current_failure();
  }
  return {};
}

/// Files in memory that tasks share. Before each call, another task may have its turn.
class SharedFiles : public MemoryFiles {
 public:
  explicit SharedFiles(std::uint64_t seed) : numbers_(seed) {}

  std::size_t number_below(std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(numbers_);
  }

  void begin(Task task) {
    Task& one = tasks_.emplace_back(std::move(task));
    one.thread = std::thread([this, &one] {
      this_task = &one;
      wait_for_turn(&one);
      one.failure = run(one.words);
      one.has_ended = true;
      this_task = nullptr;
      pass_to(nullptr);
    });
  }
  std::size_t running() const { return tasks_.size(); }

  /// Lets tasks take turns until one has ended. Its files are closed then, and its locks are gone.
  Task next_end() {
    Task* first = &*std::next(tasks_.begin(), static_cast<std::ptrdiff_t>(number_below(tasks_.size())));
    pass_to(first);
    wait_for_turn(nullptr);
    const auto ended = std::ranges::find_if(tasks_, &Task::has_ended);
    ended->thread.join();
    for (const int file : ended->opened) MemoryFiles::close(file);
    Task task = std::move(*ended);
    tasks_.erase(ended);
    return task;
  }

  /// Called after a name was given to a file, and before a file is removed.
  std::function<void(const std::string&path)> after_naming, before_removal;
  bool has_locks = std::getenv("TAGRID_NO_LOCKS") == nullptr;  ///< The test must fail without.

  int open(const std::string& path, const Opening& how) override {
    return enters() ? noted(MemoryFiles::open(path, how)) : -1;
  }
  int open_folder(const std::string& path) override {
    return enters() ? noted(MemoryFiles::open_folder(path)) : -1;
  }
  int open_nameless(const std::string& folder) override {
    return enters() ? noted(MemoryFiles::open_nameless(folder)) : -1;
  }
  int duplicate(int file) override { return enters() ? noted(MemoryFiles::duplicate(file)) : -1; }
  bool close(int file) override {
    if (!enters()) return false;
    if (Task* task = task_of_call(); task != nullptr) task->opened.erase(file);
    return MemoryFiles::close(file);
  }
  std::ptrdiff_t read_at(int file, std::uint64_t position, std::span<std::byte> to) override {
    return enters() ? MemoryFiles::read_at(file, position, to) : -1;
  }
  std::ptrdiff_t write(int file, std::span<const std::byte> bytes) override {
    if (enters()) return MemoryFiles::write(file, bytes);
    if (dies_now()) MemoryFiles::write(file, bytes.first(number_below(bytes.size() + 1)));
    return -1;
  }
  bool write_at(int file, std::uint64_t position, std::span<const std::byte> bytes) override {
    if (enters()) return MemoryFiles::write_at(file, position, bytes);
    if (dies_now()) MemoryFiles::write_at(file, position, bytes.first(number_below(bytes.size() + 1)));
    return false;
  }
  bool resize(int file, std::uint64_t size) override { return enters() && MemoryFiles::resize(file, size); }
  bool sync(int file) override { return enters() && MemoryFiles::sync(file); }
  bool status(int file, FileStatus& status) override { return enters() && MemoryFiles::status(file, status); }
  bool status(const std::string& path, bool follows_link, FileStatus& status) override {
    return enters() && MemoryFiles::status(path, follows_link, status);
  }
  bool lock(int file, bool waits) override {
    if (!has_locks) return enters();
    for (;;) {
      if (!enters()) return false;
      if (MemoryFiles::lock(file, false)) return true;
      if (errno != EWOULDBLOCK || !waits) return false;
      take_turns();  // until the holder has gone on
    }
  }
  bool rename(const std::string& from, const std::string& to) override {
    return enters() && named(MemoryFiles::rename(from, to), to);
  }
  bool rename_to_new(const std::string& from, const std::string& to) override {
    return enters() && named(MemoryFiles::rename_to_new(from, to), to);
  }
  bool exchange(const std::string& a, const std::string& b) override {
    return enters() && named(MemoryFiles::exchange(a, b), b);
  }
  bool link(const std::string& from, const std::string& to) override {
    return enters() && named(MemoryFiles::link(from, to), to);
  }
  bool unlink(const std::string& path) override {
    if (!enters()) return false;
    before_removal(path);
    return MemoryFiles::unlink(path);
  }
  bool make_folder(const std::string& path, unsigned mode) override {
    return enters() && MemoryFiles::make_folder(path, mode);
  }
  bool list(const std::string& folder, std::vector<FolderEntry>& entries) override {
    return enters() && MemoryFiles::list(folder, entries);
  }

 private:
  /// A thread of a task besides its first one works while that one waits for it.
  Task* task_of_call() const { return this_task != nullptr ? this_task : turn_.load(); }

  /// False if the process of the task has been killed.
  bool enters() {
    Task* task = task_of_call();
    if (task == nullptr) return true;
    if (++task->calls == task->dies_at) task->is_dead = true;
    if (!task->is_dead && this_task != nullptr && number_below(8) == 0) take_turns();
    errno = task->is_dead ? EIO : 0;
    return !task->is_dead;
  }
  bool dies_now() const {
    const Task* task = task_of_call();
    return task != nullptr && task->calls == task->dies_at;
  }
  int noted(int file) {
    if (Task* task = task_of_call(); task != nullptr && file >= 0) task->opened.insert(file);
    return file;
  }
  bool named(bool is_named, const std::string& path) const {
    if (is_named) after_naming(path);
    return is_named;
  }

  /// Lets a task go on, which may be this one.
  void take_turns() {
    Task* other = &*std::next(tasks_.begin(), static_cast<std::ptrdiff_t>(number_below(tasks_.size())));
    if (other == this_task || other->has_ended) return;
    pass_to(other);
    wait_for_turn(this_task);
  }
  void pass_to(Task* task) {
    const std::lock_guard guard(mutex_);
    turn_ = task;
    passed_.notify_all();
  }
  void wait_for_turn(const Task* task) {
    std::unique_lock lock(mutex_);
    passed_.wait(lock, [&] { return turn_ == task; });
  }

  std::mt19937_64 numbers_;
  std::list<Task> tasks_;
  std::atomic<Task*> turn_ = nullptr;  ///< nullptr: the test itself
  std::mutex mutex_;
  std::condition_variable passed_;
};

/// A job of an array, which is started until it ends with exit code 0.
struct Job {
  Words words;
  bool removes = false, is_done = false;
  std::size_t starts = 0, running = 0;
};

constexpr std::size_t scan_count = 120, task_count = 1000, at_once = 8;

std::string original_of(std::size_t scan) { return fmt::format("/memory/in/s{:03}.nrrd", scan); }
std::string output_of(std::size_t scan) { return fmt::format("/memory/out/s{:03}.tag", scan); }

std::string scan_content(std::size_t scan) {
  std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n\n";
  for (std::size_t i = 0; i < 64; ++i) nrrd += static_cast<char>(i * 3 + scan % 97 + i / 16 * (scan / 97));
  return nrrd;
}

const Words convert = {
    "convert", "--manifest", "/memory/in/list", "--output-dir", "/memory/out", "--max-error", "0", "-T",
    "1",       "-q"};

Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

class ThousandTasks : public testing::TestWithParam<std::uint64_t> {
 protected:
  void SetUp() override {
    testing::internal::CaptureStderr();  // what tasks say
    std::string list;
    for (std::size_t i = 0; i < scan_count; ++i) {
      disk_.add(original_of(i), scan_content(i));
      list += original_of(i) + "\n";
    }
    disk_.add("/memory/in/list", list);
    disk_.add_folder("/memory/out");
    encode_alone();
    for (const auto& [shards, removes] : {std::pair(120, false), {40, false}, {6, true}})
      for (int i = 0; i < shards; ++i)
        jobs_.push_back({with(convert, {"--shard", fmt::format("{}/{}", i, shards),
                                        removes ? "--remove-verified" : "--skip-done"}),
                         removes});
    disk_.after_naming = [this](const std::string& path) { check_name(path); };
    disk_.before_removal = [this](const std::string& path) { check_removal(path); };
  }
  void TearDown() override {
    const std::string said = testing::internal::GetCapturedStderr();
    if (HasFailure()) std::cerr << said.substr(said.size() - std::min<std::size_t>(said.size(), 3000));
  }

  /// What each output must be.
  void encode_alone() {
    const auto alone = disk_.copy();
    const FilesInstead instead(*alone);
    ASSERT_EQ(run(convert).code, 0);
    for (std::size_t i = 0; i < scan_count; ++i) whole_[output_of(i)] = alone->content(output_of(i));
  }

  void check_name(const std::string& path) {
    const auto found = whole_.find(path);
    if (found == whole_.end()) return;
    EXPECT_EQ(++named_[path], 1U) << path << " was encoded and named twice";
    EXPECT_EQ(disk_.content(path), found->second) << path << " is another file";
  }

  /// What is removed comes back from what has reached the disk.
  void check_removal(const std::string& path) {
    if (whole_.contains(path)) ADD_FAILURE() << path << ": an output is removed";
    if (!path.ends_with(".nrrd")) return;
    const std::string name = path.substr(path.size() - 9, 4) + ".tag", output = "/memory/out/" + name;
    const auto cut = disk_.copy();
    cut->cut_power(0);
    EXPECT_EQ(cut->content(output), whole_.at(output))
        << path << " is removed before " << output << " is there";
    const std::vector<std::string> all = cut->all();
    EXPECT_TRUE(std::ranges::any_of(all,
                                    [&](const std::string& file) {
                                      return file.ends_with(".jsonl") &&
                                             cut->content(file).find(
                                                 fmt::format(R"("output":"{}","status":"removed")", name)) !=
                                                 std::string::npos;
                                    }))
        << path << " is removed without a record";
  }

  /// The number of a job to start next; nothing if all are done.
  std::optional<std::size_t> next_job() {
    std::vector<std::size_t> possible;
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      const Job& job = jobs_[i];
      const bool is_wanted = !job.is_done && job.running == 0;
      const bool is_one_more = started_ < task_count && disk_.number_below(job.removes ? 200 : 40) ==
                                                            0;  // a job that runs, or is done
      // Removals are many times as long, and are not tried in vain too often.
      if ((is_wanted && (!job.removes || disk_.number_below(20) == 0)) || is_one_more) possible.push_back(i);
    }
    if (!possible.empty()) return possible[disk_.number_below(possible.size())];
    const auto left =
        std::ranges::find_if(jobs_, [](const Job& job) { return !job.is_done && job.running == 0; });
    return left == jobs_.end() ? std::nullopt : std::optional<std::size_t>(left - jobs_.begin());
  }

  void start(std::size_t number) {
    Job& job = jobs_[number];
    Task task{.job = number, .words = job.words};
    ++job.starts, ++job.running, ++started_;
    // Early calls are as likely as many times later ones.
    if (started_ <= task_count && disk_.number_below(3) > 0)
      task.dies_at =
          1 + disk_.number_below(std::size_t{1} << (1 + disk_.number_below(job.removes ? 13 : 10)));
    task.skew = static_cast<std::time_t>(disk_.number_below(8 * 3600)) - 4 * 3600;
    task.host = fmt::format("node{}", disk_.number_below(40));
    disk_.begin(std::move(task));
  }

  void settle(const Task& task) {
    Job& job = jobs_[task.job];
    --job.running;
    killed_ += task.is_dead;
    if (task.is_dead) return;
    const int code = task.failure.code;
    EXPECT_TRUE(code == 0 || code == 65 || code == 74 || code == 75) << code << " " << task.failure.message;
    if (code == 0) job.is_done = true;
  }

  void run_all() {
    const FilesInstead instead(disk_);
    constexpr std::size_t most = task_count + task_count / 4;
    while (!HasFailure() && started_ < most) {
      while (disk_.running() < at_once) {
        const auto job = next_job();
        if (!job) break;
        start(*job);
      }
      if (disk_.running() == 0) break;
      settle(disk_.next_end());
    }
    while (disk_.running() > 0) disk_.next_end();
    EXPECT_LT(started_, most) << "the list does not become complete";
  }

  SharedFiles disk_{GetParam()};
  std::vector<Job> jobs_;
  std::map<std::string, std::string> whole_;  ///< outputs
  std::map<std::string, std::size_t> named_;
  std::size_t started_ = 0, killed_ = 0;
};

/// The state of an output by the rule of docs/archives.md.
std::map<std::string, std::string> newest_states(const MemoryFiles& files) {
  std::map<std::string, std::pair<std::tuple<std::uint64_t, bool, double>, std::string>> newest;
  for (const std::string& path : files.all()) {
    if (!path.ends_with(".jsonl")) continue;
    std::istringstream lines(files.content(path));
    for (std::string line; std::getline(lines, line);) {
      const auto json = nlohmann::json::parse(line, nullptr, false);
      EXPECT_FALSE(json.is_discarded()) << path << ": " << line;
      const std::string status = json.value("status", "");
      if (status != "ok" && status != "removed" && status != "damaged") continue;
      auto& known = newest[json.at("output").get<std::string>()];
      const std::tuple time(json.at("sequence").get<std::uint64_t>(), status == "removed",
                            json.at("finished").get<double>());
      if (known.second.empty() || time >= known.first) known = {time, status};
    }
  }
  std::map<std::string, std::string> states;
  for (const auto& [output, one] : newest) states[output] = one.second;
  return states;
}

TEST_P(ThousandTasks, MakeOneListComplete) {
  SCOPED_TRACE(fmt::format("seed {} (TAGRID_SEED)", GetParam()));
  run_all();
  if (HasFailure()) {
    std::cout << started_ << " tasks were started\n";
    return;
  }
  EXPECT_GE(started_, task_count);
  EXPECT_GT(killed_, task_count / 3);
  const auto states = newest_states(disk_);
  for (std::size_t i = 0; i < scan_count; ++i) {
    EXPECT_FALSE(disk_.has(original_of(i))) << original_of(i) << " is still there";
    EXPECT_EQ(disk_.content(output_of(i)), whole_.at(output_of(i))) << output_of(i);
    const auto state = states.find(output_of(i).substr(std::string("/memory/out/").size()));
    EXPECT_TRUE(state != states.end() && state->second == "removed") << output_of(i);
  }
  // Another run finds nothing to do, and nothing but hidden files of locks is left of those that were killed.
  const FilesInstead instead(disk_);
  const Failure last = run(with(convert, {"--skip-done"}));
  EXPECT_EQ(last.code, 0) << last.message;
  for (const std::string& path : disk_.all())
    EXPECT_TRUE(path == "/memory/in/list" || whole_.contains(path) || path.ends_with(".jsonl") ||
                path.ends_with(".lock") || path.ends_with(".holder"))
        << path << " is left";
  std::cout << started_ << " tasks, " << killed_ << " killed\n";
}

TEST(ThousandTasksClocks, AreThoseOfTheirMachines) {
  const double here = seconds_since_1970();
  Task task;
  task.skew = -7200;
  this_task = &task;
  const double there = seconds_since_1970();
  this_task = nullptr;
  EXPECT_NEAR(there - here, -7200, 60);
}

std::vector<std::uint64_t> seeds() {
  const char* given = std::getenv("TAGRID_SEED");
  const std::uint64_t first = given == nullptr ? 1 : std::strtoull(given, nullptr, 10);
  std::vector<std::uint64_t> all = {first};
  if (std::getenv("TAGRID_LONG") != nullptr)
    for (std::uint64_t i = 1; i < 20; ++i) all.push_back(first + i);
  return all;
}

INSTANTIATE_TEST_SUITE_P(, ThousandTasks, testing::ValuesIn(seeds()));

}  // namespace
}  // namespace tagrid

// The clock and the name of the machine of a task, for all code that asks for them.

extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  static const auto of_system =
      reinterpret_cast<int (*)(clockid_t, timespec*)>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = of_system(clock, now);
  if (clock == CLOCK_REALTIME && tagrid::this_task != nullptr) now->tv_sec += tagrid::this_task->skew;
  return result;
}

extern "C" int gethostname(char* name, std::size_t size) noexcept {
  static const auto of_system =
      reinterpret_cast<int (*)(char*, std::size_t)>(dlsym(RTLD_NEXT, "gethostname"));
  if (tagrid::this_task == nullptr) return of_system(name, size);
  std::strncpy(name, tagrid::this_task->host.c_str(), size);
  return 0;
}
