#include "io/programs/served_mesh.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "io/errors/errors.h"

namespace tagrid {
namespace {

// Bytes of an array, and numbers of a point, then fit into 63 bits.
constexpr std::int64_t most_entries = std::int64_t{1} << 56;

std::int64_t count_of(const OrderedJson& mesh, const char* what) {
  const OrderedJson& count = mesh.at(what);
  const bool is_count =
      count.is_number_unsigned() && count.get<std::uint64_t>() <= std::uint64_t{most_entries};
  if (!is_count) throw UsageError(fmt::format("a mesh cannot have {} {}", count.dump(), what));
  return count;
}

MeshLayout::Data data_of(const OrderedJson& mesh, const char* what) {
  MeshLayout::Data data;
  for (const OrderedJson& array : mesh.value(what, OrderedJson::array())) {
    const std::string name = array.at("name"), type = array.at("type");
    const auto known = sample_type_named(type);
    if (!known) throw UsageError(fmt::format("the type {} is not known", OrderedJson(type).dump()));
    if (name.empty() || name.find('/') != name.npos || name == "." || name == positions_array ||
        name == connectivity_array)
      throw UsageError(fmt::format("data cannot have the name {}", OrderedJson(name).dump()));
    data.emplace_back(name, *known);
  }
  return data;
}

}  // namespace

WriteMeshRequest mesh_request_of(const OrderedJson& json) {
  const OrderedJson& mesh = json.at("mesh");
  return {json.at("path"),
          json.value("name", json.at("path").get<std::string>()),
          {count_of(mesh, "points"), count_of(mesh, "tetrahedra"), data_of(mesh, "point_data"),
           data_of(mesh, "cell_data")},
          json.value("options", WriterOptions())};
}

void MeshEntries::skip_complete() {
  for (; array_ < arrays_.size() && entry_ == arrays_[array_].entries; ++array_) entry_ = 0;
}

MeshPiece MeshEntries::next(const std::string& name, std::int64_t from, std::int64_t to,
                            const std::string& file) {
  skip_complete();
  if (array_ == arrays_.size())
    throw UsageError(fmt::format("{}: entries of {} come when the mesh is complete", file, name));
  const MeshArray& array = arrays_[array_];
  if (name != array.name || from != entry_ || to <= from || to > array.entries)
    throw UsageError(fmt::format("{}: entries [{}, {}) of {} come, but those of {} from {} to {} are next",
                                 file, from, to, name, array.name, entry_, array.entries));
  if (static_cast<std::uint64_t>(to - from) > most_bytes_of_piece / array.entry_bytes)
    throw UsageError(fmt::format("{}: {} entries of {} at once are more than {} bytes", file, to - from, name,
                                 most_bytes_of_piece));
  entry_ = to;
  const std::int64_t count = to - from;
  return {array_, from, count, static_cast<std::size_t>(count) * array.entry_bytes};
}

void MeshEntries::require_all(const std::string& file) {
  skip_complete();
  if (array_ < arrays_.size())
    throw UsageError(fmt::format("{}: the array {} ends after {} of {} entries", file, arrays_[array_].name,
                                 entry_, arrays_[array_].entries));
}

}  // namespace tagrid
