#include "io/formats/zarr/metadata.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/metadata/lengths.h"
#include "io/metadata/text.h"

namespace tagrid {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json or_null(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? Json(*number) : Json();
}

std::string name_of_unit(const std::string& unit) {
  const auto known = length_unit(unit);
  if (!known) return "";
  // The names of UDUNITS-2, as OME-Zarr has them.
  static constexpr std::pair<double, const char*> names[] = {
      {1e15, "meter"},     {1e13, "centimeter"}, {1e14, "decimeter"}, {1e12, "millimeter"},
      {1e9, "micrometer"}, {1e6, "nanometer"},   {1e3, "picometer"},  {1, "femtometer"},
      {1e5, "angstrom"},   {1e18, "kilometer"},  {2.54e13, "inch"},   {3.048e14, "foot"},
      {9.144e14, "yard"}};
  for (const auto& [femtometers, name] : names)
    if (known->femtometers == femtometers) return name;
  return "";
}

/// The center of a block lies half of a block, less half a sample, behind the first sample in it.
Json transformations(const Geometry& geometry, std::int64_t factor) {
  Json scale = Json::array(), translation = Json::array();
  for (const std::size_t axis : {2, 1, 0}) {
    const double spacing = spacing_or_1(geometry, axis);
    scale.push_back(spacing * static_cast<double>(factor));
    translation.push_back(geometry.origin[axis] + spacing * static_cast<double>(factor - 1) / 2);
  }
  return {{{"type", "scale"}, {"scale", scale}}, {{"type", "translation"}, {"translation", translation}}};
}

Json numbers_of(const Index3& size) { return {size.z, size.y, size.x}; }

}  // namespace

std::string zarr_group(const VolumeInfo& info, const KnownFacts& facts, const std::string& name) {
  const Geometry geometry = in_one_unit(info.geometry());
  Json axes = Json::array();
  for (const auto& [letter, axis] : {std::pair("z", 2), {"y", 1}, {"x", 0}}) {
    Json one = {{"name", letter}, {"type", "space"}};
    if (std::string unit = name_of_unit(geometry.units[static_cast<std::size_t>(axis)]); !unit.empty())
      one["unit"] = std::move(unit);
    axes.push_back(std::move(one));
  }
  Json datasets = Json::array();
  datasets.push_back({{"path", "0"}, {"coordinateTransformations", transformations(geometry, 1)}});
  for (const MeansLevel& level : facts.levels)
    datasets.push_back({{"path", std::to_string(datasets.size())},
                        {"coordinateTransformations", transformations(geometry, level.factor)}});
  Json multiscale = {{"name", name}, {"axes", std::move(axes)}, {"datasets", std::move(datasets)}};
  if (!facts.levels.empty()) multiscale["type"] = "mean";
  Json ome = {{"version", "0.5"}, {"multiscales", Json::array({std::move(multiscale)})}};
  if (facts.range)
    ome["omero"] = {{"channels", Json::array({{{"active", true},
                                               {"color", "FFFFFF"},
                                               {"label", name},
                                               {"window",
                                                {{"min", (*facts.range)[0]},
                                                 {"max", (*facts.range)[1]},
                                                 {"start", (*facts.range)[0]},
                                                 {"end", (*facts.range)[1]}}}}})}};
  const Json tagrid = {{"max_error", or_null(facts.max_error)},
                       {"achieved_max_error", or_null(facts.achieved_error)},
                       {"nrrd_header", text_of(info.metadata)}};
  return text_of({{"zarr_format", 3},
                  {"node_type", "group"},
                  {"attributes", {{"ome", std::move(ome)}, {"tagrid", tagrid}}}});
}

std::string zarr_array(const Index3& dims, SampleType type, const ZarrChunks& chunks) {
  const Json bytes = {{"name", "bytes"}, {"configuration", {{"endian", "little"}}}};
  Json codecs = Json::array({bytes});
  if (chunks.shard) {
    const Json zstd = {{"name", "zstd"}, {"configuration", {{"level", zarr_zstd_level}, {"checksum", true}}}};
    codecs = Json::array({{{"name", "sharding_indexed"},
                           {"configuration",
                            {{"chunk_shape", numbers_of(chunks.chunk)},
                             {"codecs", {bytes, zstd}},
                             {"index_codecs", {bytes, {{"name", "crc32c"}}}},
                             {"index_location", "end"}}}}});
  }
  const Index3& file = chunks.shard ? *chunks.shard : chunks.chunk;
  return text_of(
      {{"zarr_format", 3},
       {"node_type", "array"},
       {"shape", numbers_of(dims)},
       {"data_type", name_of(type)},
       {"chunk_grid", {{"name", "regular"}, {"configuration", {{"chunk_shape", numbers_of(file)}}}}},
       {"chunk_key_encoding", {{"name", "default"}, {"configuration", {{"separator", "/"}}}}},
       {"fill_value", is_float_type(type) ? Json(0.0) : Json(0)},
       {"codecs", std::move(codecs)},
       {"attributes", Json::object()},
       {"dimension_names", {"z", "y", "x"}}});
}

}  // namespace tagrid
