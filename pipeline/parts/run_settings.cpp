#include "pipeline/parts/run_settings.h"

#include <fmt/format.h>

namespace tagrid {
namespace {

std::string bound(double value) { return value < 0 ? "none" : fmt::format("{}", value); }

std::string given(const std::string& value) { return value.empty() ? "not given" : value; }

}  // namespace

std::vector<std::pair<std::string, std::string>> settings_of(const CodingParameters& p,
                                                             const SourceDescription& source) {
  const bool ranged = p.range_low < p.range_high;
  return {
      {"dims", fmt::format("{},{},{}", p.dims.x, p.dims.y, p.dims.z)},
      {"type", std::string(name_of(p.type))},
      {"endian", source.raw && source.raw->big_endian.value_or(false) ? "big" : "little"},
      {"offset", fmt::format("{}", source.raw ? source.raw->offset : 0)},
      {"vdb-grid", given(source.vdb_grid)},
      {"from", given(source.from)},
      {"series", given(source.series)},
      {"dataset", given(source.dataset)},
      {"grid-only", p.mode == FileMode::grid ? "given" : "not given"},
      {"grid", std::string(name_of(p.grid))},
      {"max-error", bound(p.max_error)},
      {"surface-error", bound(p.surface_error)},
      {"mesh-error", bound(p.mesh_error)},
      {"effort", std::string(name_of(p.effort))},
      {"accuracy", fmt::format("{}", p.accuracy)},
      {"cube", fmt::format("{}", p.cube_size)},
      {"brick", fmt::format("{}", p.brick_edge)},
      {"max-level", fmt::format("{}", p.max_level)},
      {"range", ranged ? fmt::format("{}:{}", p.range_low, p.range_high) : "not given"},
      {"field-scale", fmt::format("{}", p.field_scale)},
  };
}

}  // namespace tagrid
