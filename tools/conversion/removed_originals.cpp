#include "tools/conversion/removed_originals.h"

#include <algorithm>
#include <filesystem>

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

}  // namespace

std::vector<RemovedOriginal> removed_originals(const std::string& output_dir) {
  const KnownOutputs known(output_dir);
  std::vector<RemovedOriginal> originals;
  for (const auto& [output, one] : known.all()) {
    if (one.state != KnownOutput::State::removed || one.input_files.empty()) continue;
    // A record is a line of text that anybody may have changed.
    if (output_called(output) != output)
      throw UsageError(output + ": is in a record, and is not a name that convert gives an output");
    originals.push_back({one.input, (fs::path(output_dir) / output).string(),
                         common_folder(one.input_files).string(),
                         std::ranges::all_of(one.input_files, is_back)});
  }
  return originals;
}

}  // namespace tagrid
