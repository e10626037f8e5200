#include "tools/catalogue/facts.h"

#include <memory>

#include "io/files/file_bytes.h"
#include "io/tag/bricks.h"
#include "stages/grid/box.h"
#include "tools/report/info.h"
#include "tools/report/report.h"

namespace tagrid {

using nlohmann::ordered_json;

FileFacts facts_of(const std::string& path) {
  const TagBricks file(std::make_shared<FileSource>(path));
  const TagHeader& header = file.header();
  const CodingParameters& p = header.parameters;
  FileFacts facts;
  facts.subject = subject_of(header.metadata);
  facts.type = name_of(p.type);
  if (p.max_error >= 0) facts.bound = p.max_error;
  facts.voxels = static_cast<std::uint64_t>(Box::of_size(header.all_dims()).count());
  facts.raw_bytes = facts.voxels * size_of(p.type);
  facts.more = contents_json(header, file.index().total);
  return facts;
}

std::string without_path(std::string message, const std::string& path) {
  if (message.starts_with(path + ": ")) message.erase(0, path.size() + 2);
  return message;
}

}  // namespace tagrid
