#include "io/meshes/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/errors/errors.h"
#include "io/programs/filled_file.h"
#include "io/programs/find.h"
#include "io/programs/writer_conversation.h"

namespace tagrid {
namespace {

/// Sends one array. `number_of` changes each of its bytes, if it is given.
void send(WriterConversation& writer, const MeshArray& array, SpoolFile& spool,
          std::byte (*number_of)(std::byte) = nullptr) {
  std::vector<std::byte> changed;
  for_each_piece(spool, array.entry_bytes, [&](std::int64_t first, std::span<const std::byte> piece) {
    writer.announce_entries(array.name, first,
                            first + static_cast<std::int64_t>(piece.size() / array.entry_bytes));
    if (number_of != nullptr) {
      changed.assign(piece.begin(), piece.end());
      for (std::byte& byte : changed) byte = number_of(byte);
      piece = changed;
    }
    writer.write(piece.data(), piece.size());
  });
}

WriterOptions options_of(const MeshNotes& notes) {
  WriterOptions options = {{"format", "vtkhdf"}};
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

VtkhdfFile::VtkhdfFile(const std::string& path, SampleType value_type, bool overwrite)
    : MeshFile(path, value_type, overwrite), path_(path), program_(writer_for(path, "VTKHDF", "hdf5")) {}

void VtkhdfFile::write_mesh() {
  FilledFile filled(output_, path_);
  WriterConversation writer(program_);
  MeshLayout layout = {mesh_.points,
                       mesh_.tetrahedra,
                       {{"value", mesh_.value_type}},
                       {{"level", SampleType::uint8}, {"type", SampleType::uint8}}};
  if (notes_.has_rescale()) layout.point_data.emplace_back("rescaled", SampleType::float64);
  WriterReady ready = writer.begin(filled.path(), filled.name(), layout, options_of(notes_));
  if (ready.memory > memory_of_writer)
    throw WorldError(
        fmt::format("{}: the program {} wants {} bytes of memory to write a mesh, which is more than {}",
                    output_.name(), program_, ready.memory, memory_of_writer));
  warnings_ = std::move(ready.warnings);
  const std::vector<MeshArray> arrays = layout.arrays();
  send(writer, arrays[0], mesh_.coordinates);
  send(writer, arrays[1], mesh_.connectivity);
  send(writer, arrays[2], mesh_.values);
  const std::size_t cell_data = 2 + layout.point_data.size();
  if (notes_.has_rescale())
    for_each_rescaled([&](std::int64_t first, std::span<const std::byte> numbers) {
      writer.announce_entries(arrays[3].name, first,
                              first + static_cast<std::int64_t>(numbers.size() / sizeof(double)));
      writer.write(numbers.data(), numbers.size());
    });
  send(writer, arrays[cell_data], mesh_.levels);
  send(writer, arrays[cell_data + 1], mesh_.levels, primitive_of);
  writer.finish();
  bytes_ = filled.complete();
}

}  // namespace tagrid
