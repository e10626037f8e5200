// What a file of tetrahedra has, whatever they are: of the grid, or of materials.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/spool_file.h"
#include "io/meshes/material_mesh.h"
#include "io/meshes/noted_file.h"
#include "io/programs/writer_conversation.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// Where the numbers of an array of a mesh come from.
struct SpooledNumbers {
  SpoolFile* spool;
};
struct RescaledNumbers {  ///< slope * value + intercept, as float64
  SpoolFile* values;
  SampleType type;
  Rescale rescale;
};
struct PrimitiveNumbers {  ///< 0, 1, 2: I, II, III, from levels of tetrahedra, as uint8
  SpoolFile* levels;
};
struct MaterialNumbers {  ///< the label of the material of each tetrahedron
  const std::vector<MaterialElements>* materials;
};

/// A number for each point, or for each cell, by a name.
struct MeshData {
  std::string name;
  SampleType type;
  std::variant<SpooledNumbers, RescaledNumbers, PrimitiveNumbers, MaterialNumbers> numbers;
};

/// Calls use(first, bytes) for all numbers, little endian, in order, in pieces; see above.
template <class Use>
void for_each_piece(const MeshData& data, Use use);

/// References to the arrays of a mesh, which must outlive it.
struct MeshContents {
  MeshNotes notes;
  std::vector<MeshField> fields;
  std::size_t nodes = 4;  ///< of a cell: 4, or 10 in the order of MaterialMesh::nodes
  std::int64_t points = 0, cells = 0;
  SpoolFile* coordinates = nullptr;   ///< x y z of each point: float64
  SpoolFile* connectivity = nullptr;  ///< the points of each cell, from 0 on: int64
  std::vector<MeshData> point_data, cell_data;
};

/// A mesh with the cell data `material`: labels, as the first of int32, uint32 and float64 that holds them. Their
/// names are in the fields `material_names` and `material_labels`.
MeshContents contents_of(MaterialMesh& mesh);

namespace mesh_contents_detail {

constexpr std::int64_t numbers_at_once = std::int64_t{1} << 16;

template <class Use>
void pass(const SpooledNumbers& numbers, SampleType type, Use use) {
  for_each_piece(*numbers.spool, size_of(type), use);
}

/// Computes `count` numbers from the number `first` on, in pieces: compute(i) is number i of them.
template <class T, class Compute, class Use>
void pass_computed(std::int64_t first, std::int64_t count, Compute compute, Use use) {
  std::vector<std::byte> bytes;
  for (std::int64_t begin = 0; begin < count; begin += numbers_at_once) {
    const auto n = static_cast<std::size_t>(std::min(numbers_at_once, count - begin));
    bytes.resize(n * sizeof(T));
    for (std::size_t i = 0; i < n; ++i)
      store_little_endian<T>(bytes.data() + i * sizeof(T), compute(static_cast<std::size_t>(begin) + i));
    use(first + begin, std::span<const std::byte>(bytes));
  }
}

template <class Use>
void pass(const RescaledNumbers& numbers, SampleType, Use use) {
  with_sample_type(numbers.type, [&](auto sample) {
    using T = decltype(sample);
    for_each_piece(*numbers.values, sizeof(T), [&](std::int64_t first, std::span<const std::byte> piece) {
      const auto rescaled = [&](std::size_t i) {
        return numbers.rescale.slope *
                   static_cast<double>(load_little_endian<T>(piece.data() + i * sizeof(T))) +
               numbers.rescale.intercept;
      };
      pass_computed<double>(first, static_cast<std::int64_t>(piece.size() / sizeof(T)), rescaled, use);
    });
  });
}

template <class Use>
void pass(const PrimitiveNumbers& numbers, SampleType, Use use) {
  for_each_piece(*numbers.levels, 1, [&](std::int64_t first, std::span<const std::byte> piece) {
    const auto primitive = [&](std::size_t i) {
      return static_cast<std::uint8_t>(std::to_integer<unsigned>(piece[i]) % 3);
    };
    pass_computed<std::uint8_t>(first, static_cast<std::int64_t>(piece.size()), primitive, use);
  });
}

template <class Use>
void pass(const MaterialNumbers& numbers, SampleType type, Use use) {
  with_sample_type(type, [&](auto sample) {
    using T = decltype(sample);
    for (const MaterialElements& material : *numbers.materials) {
      const auto label = [&](std::size_t) { return static_cast<T>(material.label); };
      pass_computed<T>(material.first, material.count, label, use);
    }
  });
}

}  // namespace mesh_contents_detail

template <class Use>
void for_each_piece(const MeshData& data, Use use) {
  std::visit([&](const auto& numbers) { mesh_contents_detail::pass(numbers, data.type, use); }, data.numbers);
}

}  // namespace tagrid
