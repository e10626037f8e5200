// The format: "MSH file format" of the manual of Gmsh, version 4.1, https://gmsh.info/doc/texinfo/gmsh.html
#include "io/meshes/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr int of_volumes = 3;        // the dimension of entities
constexpr int volume_tag = 1;        // of the only entity
constexpr int group_tag = 1;         // of the physical group
constexpr int gmsh_tetrahedron = 4;  // of four nodes

// Writes numbers to a file, through a buffer.
class Fields {
 public:
  explicit Fields(OutputFile& output) : output_(output), buffer_(std::size_t{1} << 16) {}

  template <class T>
  void put(T number) {
    if (size_ + sizeof(T) > buffer_.size()) flush();
    store_little_endian(buffer_.data() + size_, number);
    size_ += sizeof(T);
  }
  void flush() {
    output_.write(std::span<const std::byte>(buffer_).first(size_));
    size_ = 0;
  }

 private:
  OutputFile& output_;
  std::vector<std::byte> buffer_;
  std::size_t size_ = 0;
};

// The lowest and the highest coordinates of points.
std::array<double, 6> bounds_of(SpoolFile& coordinates) {
  constexpr double far = std::numeric_limits<double>::infinity();
  std::array<double, 6> bounds = {far, far, far, -far, -far, -far};
  for_each_piece(coordinates, 3 * sizeof(double), [&](std::int64_t, std::span<const std::byte> piece) {
    for (std::size_t i = 0; i < piece.size() / sizeof(double); ++i) {
      const auto x = load_little_endian<double>(piece.data() + i * sizeof(double));
      double &low = bounds[i % 3], &high = bounds[3 + i % 3];
      low = std::min(low, x);
      high = std::max(high, x);
    }
  });
  if (coordinates.size() == 0) bounds.fill(0);
  return bounds;
}

// Blocks of nodes and of elements begin alike: one block, how many, and their first and last numbers.
void put_block(Fields& fields, std::int64_t count, int kind) {
  const auto n = static_cast<std::uint64_t>(count);
  fields.put(std::uint64_t{1});
  fields.put(n);
  fields.put(std::uint64_t{1});
  fields.put(n);
  fields.put(of_volumes);
  fields.put(volume_tag);
  fields.put(kind);
  fields.put(n);
}

}  // namespace

void check_gmsh_count(std::int64_t count, const char* what, const std::string& name) {
  constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
  if (count > most)
    throw UsageError(fmt::format(
        "{}: a Gmsh file has at most {} {}; choose another format, or a coarser mesh", name, most, what));
}

void GmshFile::add_points(std::span<const double> xyz, std::span<const std::byte> values) {
  MeshFile::add_points(xyz, values);
  check_gmsh_count(mesh_.points, "points", output_.name());
}

void GmshFile::add_tetrahedra(std::span<const std::int64_t> connectivity,
                              std::span<const std::uint8_t> levels) {
  MeshFile::add_tetrahedra(connectivity, levels);
  check_gmsh_count(mesh_.tetrahedra, "tetrahedra", output_.name());
}

void GmshFile::write_mesh() {
  constexpr int binary = 1, bytes_of_size = 8;
  output_.write(fmt::format("$MeshFormat\n4.1 {} {}\n", binary, bytes_of_size));
  Fields fields(output_);
  fields.put(1);  // tells the order of bytes
  fields.flush();
  output_.write("\n$EndMeshFormat\n");
  if (!notes_.space.empty())
    output_.write(fmt::format("$Comments\n{}\n$EndComments\n", space_comment(notes_)));
  output_.write(
      fmt::format("$PhysicalNames\n1\n{} {} \"volume\"\n$EndPhysicalNames\n", of_volumes, group_tag));
  write_entities();
  write_nodes();
  write_elements();
  write_data_of_nodes();
  write_data_of_elements("level", [](std::byte level) { return level; });
  write_data_of_elements("type", primitive_of);
}

void GmshFile::write_entities() {
  output_.write("$Entities\n");
  Fields fields(output_);
  for (const std::uint64_t count : {0, 0, 0, 1}) fields.put(count);  // points, curves, surfaces, volumes
  fields.put(volume_tag);
  for (const double bound : bounds_of(mesh_.coordinates)) fields.put(bound);
  fields.put(std::uint64_t{1});
  fields.put(group_tag);
  fields.put(std::uint64_t{0});  // surfaces around it
  fields.flush();
  output_.write("\n$EndEntities\n");
}

void GmshFile::write_nodes() {
  output_.write("$Nodes\n");
  Fields fields(output_);
  constexpr int not_parametric = 0;
  put_block(fields, mesh_.points, not_parametric);
  for (std::int64_t i = 1; i <= mesh_.points; ++i) fields.put(static_cast<std::uint64_t>(i));
  fields.flush();
  mesh_.coordinates.read_back([&](std::span<const std::byte> part) { output_.write(part); });
  output_.write("\n$EndNodes\n");
}

void GmshFile::write_elements() {
  output_.write("$Elements\n");
  Fields fields(output_);
  put_block(fields, mesh_.tetrahedra, gmsh_tetrahedron);
  constexpr std::size_t entry = 4 * sizeof(std::int64_t);
  for_each_piece(mesh_.connectivity, entry, [&](std::int64_t first, std::span<const std::byte> piece) {
    for (std::size_t i = 0; i < piece.size(); i += sizeof(std::int64_t)) {
      if (i % entry == 0) fields.put(static_cast<std::uint64_t>(++first));
      fields.put(1 + load_little_endian<std::uint64_t>(piece.data() + i));
    }
  });
  fields.flush();
  output_.write("\n$EndElements\n");
}

template <class Pass>
void GmshFile::write_data(const char* section, const char* name, std::int64_t count, Pass pass_numbers) {
  // No real numbers but the time 0; step, components and count.
  output_.write(fmt::format("${}\n1\n\"{}\"\n1\n0\n3\n0\n1\n{}\n", section, name, count));
  Fields fields(output_);
  std::int32_t entry = 0;
  pass_numbers([&](double number) {
    fields.put(++entry);
    fields.put(number);
  });
  fields.flush();
  output_.write(fmt::format("\n$End{}\n", section));
}

void GmshFile::write_data_of_nodes() {
  write_data("NodeData", "value", mesh_.points, [&](const auto& put) {
    with_sample_type(mesh_.value_type, [&](auto type) {
      using T = decltype(type);
      for_each_piece(mesh_.values, sizeof(T), [&](std::int64_t, std::span<const std::byte> piece) {
        for (std::size_t i = 0; i < piece.size(); i += sizeof(T))
          put(static_cast<double>(load_little_endian<T>(piece.data() + i)));
      });
    });
  });
  if (!notes_.has_rescale()) return;
  write_data("NodeData", "rescaled", mesh_.points, [&](const auto& put) {
    for_each_rescaled([&](std::int64_t, std::span<const std::byte> numbers) {
      for (std::size_t i = 0; i < numbers.size(); i += sizeof(double))
        put(load_little_endian<double>(numbers.data() + i));
    });
  });
}

void GmshFile::write_data_of_elements(const char* name, std::byte (*number_of)(std::byte level)) {
  write_data("ElementData", name, mesh_.tetrahedra, [&](const auto& put) {
    for_each_piece(mesh_.levels, 1, [&](std::int64_t, std::span<const std::byte> piece) {
      for (const std::byte level : piece) put(static_cast<double>(std::to_integer<int>(number_of(level))));
    });
  });
}

}  // namespace tagrid
