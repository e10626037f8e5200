#include "io/programs/serve_writer.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/nrrd/geometry.h"
#include "io/programs/serve.h"
#include "io/programs/served_mesh.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

WriteRequest request_of(const OrderedJson& json) {
  const OrderedJson& volume = json.at("volume");
  const auto& dims = volume.at("dims");
  const auto type = sample_type_named(volume.at("type").get<std::string>());
  if (!type) throw UsageError(fmt::format("the type {} is not known", volume.at("type").dump()));
  VolumeInfo info = volume_info({dims.at(0), dims.at(1), dims.at(2)}, *type, volume.value("nrrd", ""));
  if (volume.contains("origin")) volume.at("origin").get_to(info.geometry.origin);
  return {json.at("path"), json.value("name", json.at("path").get<std::string>()), std::move(info),
          json.value("options", WriterOptions())};
}

void say_ready(const ServedFile& file, std::uint64_t bytes_of_piece) {
  say({{"answer", "ready"},
       {"memory", memory_besides + 2 * memory_of_program() + bytes_of_piece + file.memory},
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
  Written(const BeginServed& begin, const BeginServedMesh& begin_mesh)
      : begin_(begin), begin_mesh_(begin_mesh) {}

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
      throw WorldError(fmt::format("{}: the bytes end within {}", name_, within));
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

  const BeginServed& begin_;
  const BeginServedMesh& begin_mesh_;
  std::string name_;
  VolumeInfo info_;
  std::unique_ptr<ServedOutput> volume_;
  std::unique_ptr<ServedMesh> mesh_;
  MeshEntries entries_;
  std::vector<std::byte> piece_;
};

}  // namespace

int serve_writer(const std::string& name, const BeginServed& begin, const BeginServedMesh& begin_mesh) {
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
