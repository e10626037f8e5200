// VTK XML files: their FieldData, and the arrays in the AppendedData section with encoding="raw" and
// header_type="UInt64", each preceded by its size in bytes.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/output_file.h"
#include "io/files/spool_file.h"
#include "io/meshes/noted_file.h"
#include "io/programs/writer_conversation.h"

namespace tagrid {

/// The FieldData of a VTK XML file, with its line end: the space as 3D Slicer has it, the slope and intercept of
/// `value`, and `fields`; "" if there is nothing.
std::string vtk_field_data(const MeshNotes& notes, const std::vector<MeshField>& fields);

/// Writes numbers from memory to a little-endian file.
template <class Output>
void write_samples(Output& output, std::span<const std::byte> bytes, std::size_t sample_size) {
  if constexpr (std::endian::native == std::endian::little) {
    output.write(bytes);
  } else {
    std::vector<std::byte> swapped(bytes.begin(), bytes.end());
    swap_bytes_of_samples(swapped.data(), swapped.size() / sample_size, sample_size);
    output.write(std::span<const std::byte>(swapped));
  }
}

inline void write_size(OutputFile& output, std::uint64_t bytes) {
  std::array<std::byte, 8> size;
  store_little_endian(size.data(), bytes);
  output.write(size);
}

inline void write_spooled(OutputFile& output, SpoolFile& spool) {
  write_size(output, spool.size());
  spool.read_back([&](std::span<const std::byte> part) { output.write(part); });
}

/// Writes an array that depends only on the number of cells: number_of(i) for each of them.
template <class Number, class NumberOf>
void write_computed(OutputFile& output, std::int64_t count, NumberOf number_of) {
  write_size(output, static_cast<std::uint64_t>(count) * sizeof(Number));
  constexpr std::size_t batch = 1 << 14;  // numbers converted at a time
  std::vector<Number> numbers;
  for (std::int64_t i = 0; i < count;) {
    numbers.clear();
    for (; i < count && numbers.size() < batch; ++i) numbers.push_back(number_of(i));
    write_samples(output, std::as_bytes(std::span(numbers)), sizeof(Number));
  }
}

}  // namespace tagrid
