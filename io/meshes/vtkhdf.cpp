#include "io/meshes/mesh_files.h"
#include "io/meshes/mesh_writers.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/errors/errors.h"
#include "io/programs/filled_file.h"
#include "io/programs/find.h"
#include "io/programs/writer_conversation.h"

namespace tagrid {
namespace {

/// A function that sends pieces of an array.
auto sender(WriterConversation& writer, const MeshArray& array) {
  return [&](std::int64_t first, std::span<const std::byte> piece) {
    writer.announce_entries(array.name, first,
                            first + static_cast<std::int64_t>(piece.size() / array.entry_bytes));
    writer.write(piece.data(), piece.size());
  };
}

WriterOptions options_of(const MeshNotes& notes, const std::string& layout) {
  WriterOptions options = {{"format", layout}};
  if (!notes.space.empty()) options["space"] = notes.space;
  if (notes.has_rescale()) {
    options["rescale_slope"] = fmt::format("{}", notes.rescale.slope);
    options["rescale_intercept"] = fmt::format("{}", notes.rescale.intercept);
  }
  // Options are UTF-8; what is not ASCII may be anything.
  const bool is_ascii = std::ranges::all_of(notes.rescale.units, [](char c) { return (c & 0x80) == 0; });
  if (is_ascii && !notes.rescale.units.empty()) options["rescale_units"] = notes.rescale.units;
  return options;
}

}  // namespace

Hdf5MeshWriter::Hdf5MeshWriter(OutputFile& output, const std::string& path, const std::string& format)
    : output_(output), path_(path), program_(writer_for(path, format, "hdf5")) {}

void Hdf5MeshWriter::write(const MeshContents& mesh, const std::string& layout) {
  FilledFile filled(output_, path_);
  WriterConversation writer(program_);
  MeshLayout wanted = {mesh.points, mesh.cells, {}, {}, mesh.nodes, mesh.fields};
  for (const MeshData& data : mesh.point_data) wanted.point_data.emplace_back(data.name, data.type);
  for (const MeshData& data : mesh.cell_data) wanted.cell_data.emplace_back(data.name, data.type);
  WriterReady ready = writer.begin(filled.path(), filled.name(), wanted, options_of(mesh.notes, layout));
  if (ready.memory > memory_of_writer)
    throw WorldError(
        fmt::format("{}: the program {} wants {} bytes of memory to write a mesh, which is more than {}",
                    output_.name(), program_, ready.memory, memory_of_writer));
  warnings_ = std::move(ready.warnings);
  const std::vector<MeshArray> arrays = wanted.arrays();
  auto array = arrays.begin();
  for (SpoolFile* spool : {mesh.coordinates, mesh.connectivity}) {
    for_each_piece(*spool, array->entry_bytes, sender(writer, *array));
    ++array;
  }
  for (const auto* all : {&mesh.point_data, &mesh.cell_data})
    for (const MeshData& data : *all) for_each_piece(data, sender(writer, *array++));
  writer.finish();
  bytes_ = filled.complete();
}

VtkhdfFile::VtkhdfFile(const std::string& path, SampleType value_type, bool overwrite)
    : MeshFile(path, value_type, overwrite),
      hdf5_(std::make_unique<Hdf5MeshWriter>(output_, path, "VTKHDF")) {}
VtkhdfFile::~VtkhdfFile() = default;

std::uint64_t VtkhdfFile::file_bytes() const { return hdf5_->bytes(); }
std::vector<std::string> VtkhdfFile::warnings() const { return hdf5_->warnings(); }
void VtkhdfFile::write_mesh() { hdf5_->write(contents(), "vtkhdf"); }

}  // namespace tagrid
