// A file that several processes write together, each at its own positions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tagrid {

/// An existing file that is written at any position. Every failure is a WorldError that names `name`.
class PlacedFile {
 public:
  PlacedFile(const std::string& path, std::string name);
  ~PlacedFile();
  PlacedFile(const PlacedFile&) = delete;
  PlacedFile& operator=(const PlacedFile&) = delete;

  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// Makes the written bytes durable and closes the file: only after this is it certain that they were
  /// written.
  void finish();

 private:
  std::string name_;
  int descriptor_ = -1;
};

}  // namespace tagrid
