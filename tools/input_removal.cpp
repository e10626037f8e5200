#include "tools/input_removal.h"

#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "io/errors.h"
#include "io/file_attributes.h"
#include "io/system_call.h"
#include "io/volume_reader.h"

namespace tagrid {
namespace {

void require_removable(const std::string& file) {
  if (file == "-") throw UsageError("--rm: the standard input cannot be removed; leave out --rm");
  // What does not exist is found by whoever reads it.
  if (!is_regular_output(file)) throw UsageError("--rm: " + file + ": is not a file; leave out --rm");
  // The link would go and the file stay.
  if (const auto status = status_of_name(file); status && S_ISLNK(status->st_mode))
    throw UsageError("--rm: " + file + ": is a symbolic link; give the file itself, or leave out --rm");
}

}  // namespace

std::vector<std::string> removable_tag(const std::string& input, const std::string& output) {
  require_removable(input);
  if (!is_regular_output(output))
    throw UsageError("--rm: the output is not a file that stays; leave out --rm, or give -o FILE");
  return {input};
}

std::vector<std::string> removable_volume(const std::string& input, const SourceDescription& source,
                                          const std::string& output) {
  removable_tag(input, output);
  const VolumeReader reader = open_volume(input, source);
  const auto folder = std::filesystem::path(input).parent_path();
  for (const std::string& file : reader.files()) {
    require_removable(file);
    // Headers come from anywhere: one must not choose what is removed elsewhere, by whatever path.
    const auto from_there = std::filesystem::path(file).lexically_relative(folder);
    if (from_there.empty() || from_there.has_parent_path())
      throw UsageError("--rm: " + file + ": may lie in another folder than its header; leave out --rm");
  }
  if (reader.holds_other_bytes())
    throw UsageError("--rm: " + reader.files().back() +
                     ": holds bytes besides its samples, which would be lost; leave out --rm");
  return reader.files();
}

void remove_files(const std::vector<std::string>& files) {
  for (const std::string& file : files)
    if (unlink(file.c_str()) != 0) throw world_error("cannot remove", file, errno);
}

}  // namespace tagrid
