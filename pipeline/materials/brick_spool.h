// Bricks of a mesh with materials that wait in a file, in any order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "io/files/spool_file.h"
#include "stages/materials/brick_mesh.h"

namespace tagrid {

/// A brick as bytes, for a process of the same program on the same kind of machine.
std::vector<std::byte> bytes_of(const BrickMesh& brick);
/// Throws std::logic_error if they are no brick.
BrickMesh brick_of(std::span<const std::byte> bytes);

class BrickSpool {
 public:
  explicit BrickSpool(SpoolFile file) : file_(std::move(file)) {}

  void add(std::int64_t number, std::span<const std::byte> bytes);
  /// REQUIRES: it was added; nothing is added after the first call.
  std::vector<std::byte> bytes(std::int64_t number);
  BrickMesh read(std::int64_t number) { return brick_of(bytes(number)); }
  /// The numbers of all bricks, in rising order.
  std::vector<std::int64_t> numbers() const;

 private:
  struct Place {
    std::uint64_t position = 0, size = 0;
  };
  SpoolFile file_;
  std::map<std::int64_t, Place> places_;
};

}  // namespace tagrid
