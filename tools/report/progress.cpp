#include "tools/report/progress.h"
#include "io/system/files.h"
#include "io/system/this_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "io/text/text.h"
#include "tools/report/human_bytes.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds pause_of_bar{200}, pause_of_lines{30'000};

std::string duration(double seconds) {
  const auto s = static_cast<long long>(seconds + 0.5);
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                  : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

void draw(ProgressStyle style, double part, const std::string& text, int width = 30) {
  if (style == ProgressStyle::plain) return say_line(text);
  const int filled = static_cast<int>(std::clamp(part, 0.0, 1.0) * width);
  show_status(fmt::format("[{:#<{}}{: <{}}] {}", "", filled, "", width - filled, text));
}

// The texts of lists are long.
constexpr int width_of_list = 10;

/// The end of a name, which says more than its folders, in so many columns; "" if they are too few to say anything.
std::string end_of_name(const std::string& name, std::size_t columns) {
  const auto begins_character = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; };
  if (static_cast<std::size_t>(std::ranges::count_if(name, begins_character)) <= columns) return name;
  constexpr std::string_view left_out = "...";
  if (columns < left_out.size() + 5) return "";
  std::size_t begin = name.size();
  for (std::size_t left = columns - left_out.size(); left > 0; --left)
    while (!begins_character(name[--begin])) {
    }
  return std::string(left_out) + name.substr(begin);
}

}  // namespace

ProgressStyle shown_style(ProgressStyle style, bool quiet) {
  if (quiet) return ProgressStyle::none;
  if (style != ProgressStyle::automatic) return style;
  return is_terminal(standard_error) ? ProgressStyle::bar : ProgressStyle::none;
}

ProgressMeter::ProgressMeter(ProgressStyle style, bool quiet, std::string what, std::uint64_t unit_bytes)
    : style_(shown_style(style, quiet)), what_(std::move(what)), unit_bytes_(unit_bytes) {}

ProgressMeter::~ProgressMeter() {
  if (drawn_) show_status("");
}

void ProgressMeter::update(std::uint64_t done, std::uint64_t total, Clock::time_point now) {
  if (style_ == ProgressStyle::none || total == 0) return;
  if (done < done_) start_ = now;
  done_ = done;
  const bool is_bar = style_ == ProgressStyle::bar;
  if (now - last_ < (is_bar ? pause_of_bar : pause_of_lines) && (drawn_ || !is_bar)) return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double part = static_cast<double>(done) / static_cast<double>(total);
  const double rate = seconds > 0 ? static_cast<double>(done * unit_bytes_) / seconds / 1e6 : 0;
  const std::string left = part > 0 && seconds > 0 ? duration(seconds / part - seconds) : "?";
  draw(style_, part, fmt::format("{} {:3.0f} %  {:.1f} MB/s  {} left", what_, 100 * part, rate, left));
  drawn_ = is_bar;
}

ListMeter::ListMeter(ProgressStyle style, bool quiet, std::optional<std::uint64_t> volumes,
                     milliseconds pause)
    : style_(shown_style(style, quiet)), volumes_(volumes), pause_(pause) {
  if (style_ == ProgressStyle::none) return;
  try {
    thread_ = std::thread([this] { draw_until_end(); });
  } catch (const std::system_error&) {
    // The system allows no more threads, and the work does not need this one.
  }
}

ListMeter::~ListMeter() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  end_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void ListMeter::begin_volume(const std::string& name) {
  const std::lock_guard lock(mutex_);
  name_ = name;
  done_ = total_ = 0;
}

void ListMeter::update(std::uint64_t done, std::uint64_t total) {
  const std::lock_guard lock(mutex_);
  done_ = done;
  total_ = total;
}

void ListMeter::end_volume(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  ++ended_;
  worked_ += bytes > 0 ? 1 : 0;
  bytes_ += bytes;
  name_.clear();
  done_ = total_ = 0;
}

double ListMeter::part_of_volume() const {
  return total_ > 0 ? static_cast<double>(done_) / static_cast<double>(total_) : 0;
}

std::string ListMeter::counts(std::uint64_t volumes, double seconds) const {
  const double part = part_of_volume();
  const std::uint64_t bytes = bytes_ + done_;
  std::string text = fmt::format("{} of {} volumes, {}", ended_, volumes, human_bytes(bytes));
  if (seconds > 0) text += fmt::format(", {:.1f} MB/s", static_cast<double>(bytes) / seconds / 1e6);
  const double worked = static_cast<double>(worked_) + part;
  const double left = static_cast<double>(volumes - std::min(ended_, volumes)) - part;
  return text + (worked > 0 ? fmt::format(", {} left", duration(seconds / worked * left)) : ", ? left");
}

std::string ListMeter::text(double seconds, std::size_t columns) const {
  const std::string text = volumes_ ? counts(*volumes_, seconds) : counted(ended_, "volume") + " found";
  if (name_.empty()) return text;
  const std::string before = total_ > 0 ? fmt::format("; {:.0f} % of ", 100 * part_of_volume()) : "; ";
  const std::size_t taken = text.size() + before.size();
  const std::string name = end_of_name(name_, columns - std::min(taken, columns));
  return name.empty() ? text : text + before + name;
}

void ListMeter::draw_until_end() {
  const bool is_bar = style_ == ProgressStyle::bar;
  std::unique_lock lock(mutex_);
  // One column of a line stays free; the bar needs its own width and that of "[] ".
  const std::size_t around = width_of_list + 4;
  while (!end_.wait_for(lock, is_bar ? pause_of_bar : pause_, [this] { return is_over_; })) {
    const std::size_t columns = is_bar ? std::max(columns_of_terminal(), around) - around : std::string::npos;
    const std::string now = text(std::chrono::duration<double>(Clock::now() - start_).count(), columns);
    if (is_bar && !volumes_) {
      show_status(now);
      continue;
    }
    const auto volumes = static_cast<double>(std::max<std::uint64_t>(1, volumes_.value_or(0)));
    draw(style_, (static_cast<double>(ended_) + part_of_volume()) / volumes, now, width_of_list);
  }
  if (is_bar) show_status("");
}

}  // namespace tagrid
