#include "io/programs/serve_writer.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "io/programs/serve.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

WriteRequest request_of(const OrderedJson& json) {
  const OrderedJson& volume = json.at("volume");
  const auto& dims = volume.at("dims");
  const auto type = sample_type_named(volume.at("type").get<std::string>());
  if (!type) throw UsageError("the type {} is not known", volume.at("type").dump());
  VolumeInfo info{{dims.at(0), dims.at(1), dims.at(2)}, *type, parse_metadata(volume.value("nrrd", ""))};
  if (volume.contains("origin")) info.metadata.set_origin(volume.at("origin"));
  return {json.at("path"), json.value("name", json.at("path").get<std::string>()), std::move(info),
          json.value("options", WriterOptions())};
}

// Bytes of an array, and numbers of a point, then fit into 63 bits.
constexpr std::int64_t most_entries = std::int64_t{1} << 56;

std::int64_t count_of(const OrderedJson& mesh, const char* what) {
  const OrderedJson& count = mesh.at(what);
  const bool is_count =
      count.is_number_unsigned() && count.get<std::uint64_t>() <= std::uint64_t{most_entries};
  if (!is_count) throw UsageError("a mesh cannot have {} {}", count.dump(), what);
  return count;
}

MeshLayout::Data data_of(const OrderedJson& mesh, const char* what) {
  MeshLayout::Data data;
  for (const OrderedJson& array : mesh.value(what, OrderedJson::array())) {
    const std::string name = array.at("name"), type = array.at("type");
    const auto known = sample_type_named(type);
    if (!known) throw UsageError("the type {} is not known", OrderedJson(type).dump());
    if (name.empty() || name.find('/') != name.npos || name == "." || name == positions_array ||
        name == connectivity_array)
      throw UsageError("data cannot have the name {}", OrderedJson(name).dump());
    data.emplace_back(name, *known);
  }
  return data;
}

std::size_t nodes_of(const OrderedJson& mesh) {
  const auto nodes = mesh.find("nodes");
  if (nodes == mesh.end() || *nodes == 4) return 4;
  if (*nodes != 10)
    throw UsageError(fmt::format("tetrahedra have 4 or 10 nodes, but these have {}", nodes->dump()));
  return 10;
}

std::vector<MeshField> fields_of(const OrderedJson& mesh) {
  std::vector<MeshField> fields;
  for (const OrderedJson& field : mesh.value("fields", OrderedJson::array())) {
    MeshField& added =
        fields.emplace_back(MeshField{field.at("name"), field.value("texts", std::vector<std::string>()),
                                      field.value("numbers", std::vector<std::int64_t>())});
    if (added.name.empty() || added.name.find('/') != added.name.npos || added.name == ".")
      throw UsageError(fmt::format("a field cannot have the name {}", field.at("name").dump()));
  }
  return fields;
}

/// The request in a line "write-mesh". Throws UsageError if there cannot be such a mesh.
WriteMeshRequest mesh_request_of(const OrderedJson& json) {
  const OrderedJson& mesh = json.at("mesh");
  return {json.at("path"),
          json.value("name", json.at("path").get<std::string>()),
          {count_of(mesh, "points"), count_of(mesh, "tetrahedra"), data_of(mesh, "point_data"),
           data_of(mesh, "cell_data"), nodes_of(mesh), fields_of(mesh)},
          json.value("options", WriterOptions())};
}

/// Entries of one array, whose bytes come next.
struct MeshPiece {
  std::size_t array = 0;  ///< in MeshLayout::arrays()
  std::int64_t first = 0, count = 0;
  std::size_t bytes = 0;
};

/// Checks what is announced, before any memory is taken for it.
class MeshEntries {
 public:
  MeshEntries() = default;
  explicit MeshEntries(const MeshLayout& mesh) : arrays_(mesh.arrays()) {}

  /// The piece that is announced. Throws UsageError if it is not the next one, or too large.
  MeshPiece next(const std::string& name, std::int64_t from, std::int64_t to, const std::string& file) {
    skip_complete();
    if (array_ == arrays_.size())
      throw UsageError("{}: entries of {} come when the mesh is complete", file, name);
    const MeshArray& array = arrays_[array_];
    if (name != array.name || from != entry_ || to <= from || to > array.entries)
      throw UsageError("{}: entries [{}, {}) of {} come, but those of {} from {} to {} are next", file, from,
                       to, name, array.name, entry_, array.entries);
    if (static_cast<std::uint64_t>(to - from) > most_bytes_of_piece / array.entry_bytes)
      throw UsageError("{}: {} entries of {} at once are more than {} bytes", file, to - from, name,
                       most_bytes_of_piece);
    entry_ = to;
    const std::int64_t count = to - from;
    return {array_, from, count, static_cast<std::size_t>(count) * array.entry_bytes};
  }
  /// Throws UsageError if entries are missing.
  void require_all(const std::string& file) {
    skip_complete();
    if (array_ < arrays_.size())
      throw UsageError("{}: the array {} ends after {} of {} entries", file, arrays_[array_].name, entry_,
                       arrays_[array_].entries);
  }

 private:
  void skip_complete() {
    for (; array_ < arrays_.size() && entry_ == arrays_[array_].entries; ++array_) entry_ = 0;
  }

  std::vector<MeshArray> arrays_;
  std::size_t array_ = 0;   ///< whose entries come next
  std::int64_t entry_ = 0;  ///< that comes next
};

void say_ready(const ServedFile& file, std::uint64_t bytes_of_piece) {
  say({{"answer", "ready"},
       {"memory", memory_besides + 2 * memory_of_this_process() + bytes_of_piece + file.memory},
       {"warnings", file.warnings}});
}

void say_done(ServedFile& file) {
  OrderedJson facts = OrderedJson::object();
  for (const auto& [name, value] : file.finish()) facts[name] = OrderedJson::parse(value);
  say({{"answer", "done"}, {"facts", facts}});
}

/// What is written: nothing yet, a volume, or a mesh.
class Written {
 public:
  Written(BeginServed volume, BeginServedMesh mesh) : begin_(volume), begin_mesh_(mesh) {}

  /// What messages call the file.
  const std::string& name() const { return name_; }
  /// True once the writer has said that it is ready.
  bool has_begun() const { return volume_ || mesh_; }
  void answer(const OrderedJson& json) {
    const std::string what = json.value("request", "");
    if (what == "write")
      begin_volume(json);
    else if (what == "write-mesh" && begin_mesh_)
      begin_mesh(json);
    else if (what == "slices")
      take_slices(json.at("from"), json.at("to"));
    else if (what == "array")
      take_entries(json);
    else if (what == "finish")
      finish();
    else
      say({{"answer", "unknown"}});
  }

 private:
  void begin_volume(const OrderedJson& json) {
    const WriteRequest request = request_of(json);
    info_ = request.info;
    name_ = request.name;
    volume_ = begin_(request);
    say_ready(*volume_, *sample_bytes({info_.dims.x, info_.dims.y, 1}, info_.type));
  }

  void begin_mesh(const OrderedJson& json) {
    const WriteMeshRequest request = mesh_request_of(json);
    name_ = request.name;
    mesh_ = begin_mesh_(request);
    entries_ = MeshEntries(request.mesh);
    say_ready(*mesh_, most_bytes_of_piece);
  }

  /// The bytes that follow a request, which this program must take.
  const std::byte* take(std::uint64_t bytes, const std::string& within) {
    piece_.resize(memory_size(bytes));
    if (!std::cin.read(reinterpret_cast<char*>(piece_.data()), static_cast<std::streamsize>(bytes)))
      throw WorldError("{}: the bytes end within {}", name_, within);
    return piece_.data();
  }

  void take_slices(std::int64_t from, std::int64_t to) {
    if (!volume_) throw UsageError("samples come before a volume");
    const std::uint64_t bytes = *sample_bytes({info_.dims.x, info_.dims.y, 1}, info_.type);
    for (std::int64_t z = from; z < to; ++z) volume_->write_slice(z, take(bytes, fmt::format("slice {}", z)));
  }

  void take_entries(const OrderedJson& json) {
    if (!mesh_) throw UsageError("an array comes before a mesh");
    const MeshPiece piece = entries_.next(json.at("name"), json.at("from"), json.at("to"), name_);
    mesh_->write_entries(piece.array, piece.first, piece.count,
                         take(piece.bytes, fmt::format("the array {}", json.at("name").dump())));
  }

  void finish() {
    if (mesh_) {
      entries_.require_all(name_);
      return say_done(*mesh_);
    }
    if (!volume_) throw UsageError("the end comes before a volume");
    say_done(*volume_);
  }

  BeginServed begin_;
  BeginServedMesh begin_mesh_;
  std::string name_;
  VolumeInfo info_;
  std::unique_ptr<ServedOutput> volume_;
  std::unique_ptr<ServedMesh> mesh_;
  MeshEntries entries_;
  std::vector<std::byte> piece_;
};

}  // namespace

int serve_writer(const std::string& name, BeginServed begin, BeginServedMesh begin_mesh) {
  std::ios::sync_with_stdio(false);
  begin_to_answer();
  say({{"tagrid-writer", 1}, {"name", name}, {"version", TAGRID_VERSION}});
  Written written(begin, begin_mesh);
  try {
    for (std::string line; std::getline(std::cin, line);) written.answer(OrderedJson::parse(line));
  } catch (const std::exception&) {
    // What follows may be bytes: this conversation cannot go on.
    say_error(std::current_exception(), written.name(),
              written.has_begun() ? "writing it needs more memory than expected"
                                  : "to begin writing it, its writer needs more memory than its limit");
  }
  return 0;
}

}  // namespace tagrid
