// A file that is not written front to back: in pieces, or by several processes, each at its own positions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "io/files/file_attributes.h"

namespace tagrid {

/// A file that is written at any position. Every failure is a WorldError that names `name`.
class PlacedFile {
 public:
  /// The file exists, or is made if it `is_new`.
  PlacedFile(const std::string& path, std::string name, bool is_new = false);
  ~PlacedFile();
  PlacedFile(const PlacedFile&) = delete;
  PlacedFile& operator=(const PlacedFile&) = delete;

  void resize(std::uint64_t size);
  void set_attributes(const FileAttributes& attributes);
  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// Makes the written bytes durable and closes the file: only after this is it certain that they were
  /// written.
  void finish();

 private:
  std::string name_;
  int descriptor_ = -1;
};

}  // namespace tagrid
