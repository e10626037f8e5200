// The summary of a file, however it is read.
#include <type_traits>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"

namespace tagrid {
namespace {

// What is read of a member; nothing if that is damaged, as the rest of the file may be intact.
template <class Read>
std::optional<std::invoke_result_t<Read>> if_intact(const Read& read) {
  try {
    return read();
  } catch (const BrokenInput&) {
    return std::nullopt;
  }
}

}  // namespace

Statistics statistics_of_all(const TagBricks& file) {
  Statistics total = file.index().total;
  for (const Member& member : file.index().members)
    if (member.is_volume()) total.add(file.nested(member)->index().total);
  return total;
}

TagSummary summary_of(const std::string& path) {
  if (is_regular_input(path)) {
    const TagBricks file(open_source(path));
    TagSummary summary = {file.header(), file.index(), file.sizes(), file.beginning_of_envelope(),
                          file.parity()};
    VolumeNames names(file.header());
    for (const Member& member : file.index().members) {
      if (member.is_overview())
        summary.overviews.push_back(if_intact([&] { return file.parameters_of(member); }));
      if (member.is_volume()) names.add(if_intact([&] { return file.name_of(member); }).value_or(""));
    }
    summary.volume_names = names.take();
    summary.statistics = if_intact([&] { return statistics_of_all(file); });
    return summary;
  }
  TagReader reader(path);
  reader.read_to_end();
  return summary_of(reader);
}

TagSummary summary_of(const TagReader& reader) {
  const auto& overviews = reader.overviews();
  return {reader.header(),
          reader.index(),
          reader.sizes(),
          reader.beginning_of_envelope(),
          reader.parity(),
          {overviews.begin(), overviews.end()},
          reader.volume_names(),
          reader.header().volumes == 1 ? std::optional(reader.index().total) : std::nullopt};
}

int count_of_volumes(const std::string& path) { return HeaderOnly(open_source(path)).header().volumes; }

}  // namespace tagrid
