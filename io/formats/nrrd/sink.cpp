#include "io/formats/nrrd/sink.h"

#include <filesystem>

#include "io/errors/errors.h"
#include "io/formats/nrrd/header.h"
#include "io/samples/file_sink.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// A header names the file of its samples in a line of text, without quotes. Some names have another meaning
/// there.
void require_name_in_header(const VolumeInfo& info, const std::string& data_file) {
  try {
    if (parse_nrrd_header(nrrd_header_text(info, data_file)).data_files == std::vector{data_file}) return;
  } catch (const BrokenInput&) {
    // The name cannot be stored in a header.
  }
  throw UsageError(tagrid::quoted(data_file) +
                   ": a detached header cannot refer to a file of this name; choose another name");
}

}  // namespace

std::unique_ptr<VolumeSink> create_nrrd(const std::string& path, const VolumeInfo& info,
                                        const SinkOptions& options) {
  return std::make_unique<AttachedSink>(
      info, std::make_unique<OutputFile>(path, options.overwrite, output_options(options)),
      nrrd_header_text(info, {}));
}

std::unique_ptr<VolumeSink> create_nhdr(const std::string& path, const std::string& samples_path,
                                        const VolumeInfo& info, const SinkOptions& options) {
  if (path == "-") throw UsageError("a detached header (nhdr) needs a file name; choose nrrd or raw");
  if (std::filesystem::path(samples_path) == std::filesystem::path(path))
    throw UsageError(path + ": a detached header cannot be named .raw");
  const std::string data_file = std::filesystem::path(samples_path).filename().string();
  require_name_in_header(info, data_file);
  auto header =
      std::make_unique<OutputFile>(path, options.overwrite, OutputFileOptions{.like = options.like});
  auto samples = std::make_unique<OutputFile>(samples_path, options.overwrite, output_options(options));
  return std::make_unique<DetachedSink>(info, std::move(header), std::move(samples),
                                        nrrd_header_text(info, data_file));
}

std::unique_ptr<VolumeSink> create_raw(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options) {
  return std::make_unique<AttachedSink>(
      info, std::make_unique<OutputFile>(path, options.overwrite, output_options(options)));
}

}  // namespace tagrid
