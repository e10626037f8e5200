#include "pipeline/parts/run_settings.h"

#include <fmt/format.h>

#include "pipeline/job/resolved_options.h"

namespace tagrid {
namespace {

std::string given(const std::string& value) { return value.empty() ? "not given" : value; }

}  // namespace

std::vector<std::pair<std::string, std::string>> settings_of(const CodingParameters& p,
                                                             const SourceDescription& source) {
  std::vector<std::pair<std::string, std::string>> all = {
      {"dims", fmt::format("{},{},{}", p.dims.x, p.dims.y, p.dims.z)},
      {"type", std::string(name_of(p.type))},
      {"endian", source.raw && source.raw->big_endian.value_or(false) ? "big" : "little"},
      {"offset", fmt::format("{}", source.raw ? source.raw->offset : 0)},
      {"vdb-grid", given(source.vdb_grid)},
      {"from", given(source.from)},
      {"series", given(source.series)},
      {"dataset", given(source.dataset)},
  };
  for (auto& words : in_words(p)) all.push_back(std::move(words));
  return all;
}

}  // namespace tagrid
