#include "tools/conversion/removed_originals.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "io/files/errors.h"
#include "io/files/system_call.h"
#include "tools/conversion/output_names.h"
#include "tools/conversion/records.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

fs::path common_folder(const std::vector<InputFile>& files) {
  fs::path folder = fs::path(files.front().path).parent_path();
  for (const InputFile& file : files) {
    const fs::path other = fs::path(file.path).parent_path();
    fs::path both;
    const auto end = std::ranges::mismatch(folder, other).in1;
    for (auto step = folder.begin(); step != end; ++step) both /= *step;
    folder = both;
  }
  return folder;
}

bool is_back(const InputFile& file) {
  const auto status = status_of(file.path);
  return status && S_ISREG(status->st_mode) && static_cast<std::uint64_t>(status->st_size) == file.bytes;
}

/// A record is a line of text that anybody may have changed. Returns why it cannot be one of convert; "" if it can.
std::string impossible_name(const std::string& output, const KnownOutput& known) {
  const auto ends_early = [](const std::string& name) {
    return name.empty() || name.find('\0') != name.npos;
  };
  try {
    if (output_called(output) != output || ends_early(output))
      return fmt::format("{}: is in a record, and is not a name that convert gives an output", output);
  } catch (const UsageError&) {
    return fmt::format("{}: is in a record, and leads out of the folder", output);
  }
  if (known.input_files.empty()) return "its record names no files";
  for (const InputFile& file : known.input_files)
    if (ends_early(file.path)) return "its record names files that cannot be";
  return "";
}

}  // namespace

std::vector<RemovedOriginal> removed_originals(const std::string& output_dir) {
  const KnownOutputs known(output_dir);
  std::vector<RemovedOriginal> originals;
  for (const auto& [output, one] : known.all()) {
    if (one.state != KnownOutput::State::removed) continue;
    RemovedOriginal original{one.input, (fs::path(output_dir) / output).string(), "", false, ""};
    original.error = impossible_name(output, one);
    if (original.error.empty()) {
      original.folder = common_folder(one.input_files).string();
      original.is_back = std::ranges::all_of(one.input_files, is_back);
    }
    originals.push_back(std::move(original));
  }
  return originals;
}

}  // namespace tagrid
