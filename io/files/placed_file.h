// A file that several processes write together, each at places of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tagrid {

/// An existing file that is written at any place. Every failure is a WorldError that names `name`.
class PlacedFile {
 public:
  PlacedFile(const std::string& path, std::string name);
  ~PlacedFile();
  PlacedFile(const PlacedFile&) = delete;
  PlacedFile& operator=(const PlacedFile&) = delete;

  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// Makes what was written durable, and closes the file: that it was written is certain only after this.
  void finish();

 private:
  std::string name_;
  int descriptor_ = -1;
};

}  // namespace tagrid
