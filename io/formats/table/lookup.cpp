// Formats by their names, by names of files, and by what files begin with.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <set>

#include "io/formats/table/formats.h"
#include "io/programs/find.h"
#include "io/programs/volumes.h"
#include "io/samples/file_sink.h"
#include "io/text/text.h"

namespace tagrid {

std::size_t Reads::bytes_to_recognize() const {
  std::size_t most = peek;
  for (const Magic& one : magic) most = std::max(most, one.at + one.bytes.size());
  return most;
}

bool begins_with_any(std::string_view beginning, const std::vector<Magic>& magic) {
  return std::ranges::any_of(magic, [&](const Magic& one) {
    return beginning.size() >= one.at && beginning.substr(one.at).starts_with(one.bytes);
  });
}

bool Reads::begins(std::string_view beginning) const {
  return begins_with_any(beginning, magic) || (is_mine != nullptr && is_mine(beginning));
}

namespace {

/// Returns the format that an installed program adds, or nullptr without such a program.
const Format* added_format(std::string_view name) {
  struct Added {
    std::string name, extension, help;
    Format format;
  };
  static std::map<std::string, Added, std::less<>> known;
  if (const auto found = known.find(name); found != known.end()) return &found->second.format;
  if (read_format_named(name) != nullptr || !find_writer(name)) return nullptr;
  Added& added = known[std::string(name)];
  added.name = name;
  added.extension = "." + added.name;
  added.help = "written by tagrid-write-" + added.name;
  added.format.name = added.format.writes.program = added.name;
  added.format.extensions = {added.extension};
  added.format.help = added.help;
  return &added.format;
}

}  // namespace

std::vector<const Format*> written_formats() {
  std::vector<const Format*> written;
  for (const Format& format : formats())
    if (format.writes.any()) written.push_back(&format);
  return written;
}

const Format& format_named(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Format* format : written_formats()) {
    if (format->name == name) return *format;
    names.push_back(format->name);
  }
  for (const Format* format : written_formats())
    for (const std::string_view extension : format->extensions)
      if (!extension.empty() && extension.substr(1) == name) return *format;
  if (const Format* added = added_format(name)) return *added;
  throw UsageError(fmt::format("{}: must be one of {}", name, fmt::join(names, ", ")));
}

const Format* format_with_extension(const std::string& path) {
  const std::string name = lower_case(std::filesystem::path(path).filename().string());
  for (const Format* format : written_formats())
    for (const std::string_view extension : format->extensions)
      if (name.size() > extension.size() && name.ends_with(extension)) return format;
  const std::size_t dot = name.rfind('.');
  return dot == name.npos || dot == 0 ? nullptr : added_format(std::string_view(name).substr(dot + 1));
}

const Format& format_from_name(const std::string& path) {
  if (path == "-") return format_named("raw");
  if (const Format* format = format_with_extension(path)) return *format;
  std::string endings;
  const auto written = written_formats();
  for (const Format* format : written)
    endings += fmt::format("{}{} ({})",
                           format == written.front()  ? ""
                           : format == written.back() ? " or "
                                                      : ", ",
                           format->extensions.front(), format->help);
  throw UsageError(fmt::format("{}: the name of a volume must end in {}", path, endings));
}

namespace {

std::unique_ptr<VolumeSink> create_detached(const Format& format, const std::string& path,
                                            const VolumeInfo& info, const SinkOptions& options) {
  if (path == "-")
    throw UsageError(fmt::format("a detached header ({}) needs a file name; choose {} or raw", format.name,
                                 read_format_named(format.reads.as)->extensions.front().substr(1)));
  const std::filesystem::path samples = samples_path(path, format);
  if (samples == std::filesystem::path(path))
    throw UsageError(
        fmt::format("{}: a detached header cannot be named {}", path, format.writes.samples_extension));
  const std::string header = format.writes.detached_header(info, samples.filename().string());
  auto header_file =
      std::make_unique<OutputFile>(path, options.overwrite, OutputFileOptions{.like = options.like});
  auto samples_file =
      std::make_unique<OutputFile>(samples.string(), options.overwrite, output_options(options));
  return std::make_unique<DetachedSink>(info, std::move(header_file), std::move(samples_file), header);
}

}  // namespace

std::unique_ptr<VolumeSink> create_volume(const Format& format, const std::string& path,
                                          const VolumeInfo& info, const WriteOptions& options) {
  if (format.writes.detached_header != nullptr) return create_detached(format, path, info, options.files);
  if (format.writes.create != nullptr) return format.writes.create(path, info, options.known, options.files);
  if (format.writes.header != nullptr) {
    const std::string header = format.writes.header(info);
    auto file = std::make_unique<OutputFile>(path, options.files.overwrite, output_options(options.files));
    if (format.writes.in_gzip) return gzip_sink(info, std::move(file), header);
    return std::make_unique<AttachedSink>(info, std::move(file), header, std::string(format.writes.trailer));
  }
  const std::string program = writer_for(path, format.help, format.writes.program);
  auto wishes = options.wishes;
  wishes["format"] = format.name;
  return create_with_writer(program, path, info, options.files, wishes, options.first_memory);
}

const Format* read_format_named(std::string_view name) {
  for (const Format& format : formats())
    if (format.name == name && format.reads.any()) return &format;
  return nullptr;
}

std::vector<std::string> read_format_names() {
  std::set<std::string> names;
  for (const Format& format : formats())
    if (format.reads.any()) names.emplace(format.name);
  for (const FoundProgram& reader : all_readers()) names.insert(reader.name);
  return {names.begin(), names.end()};
}

std::size_t bytes_to_recognize() {
  std::size_t most = 0;
  for (const Format& format : formats()) most = std::max(most, format.reads.bytes_to_recognize());
  return most;
}

const Format* format_of(std::string_view beginning) {
  for (const Format& format : formats())
    if (format.reads.any() && format.reads.begins(beginning)) return &format;
  return nullptr;
}

const Format* format_of_folder(const std::string& folder) {
  for (const Format& format : formats())
    if (format.reads.is_folder != nullptr && format.reads.is_folder(folder)) return &format;
  return nullptr;
}

std::string samples_path(const std::string& path, const Format& format) {
  if (format.writes.samples_extension.empty()) return path;
  return std::filesystem::path(path).replace_extension(format.writes.samples_extension).string();
}

}  // namespace tagrid
