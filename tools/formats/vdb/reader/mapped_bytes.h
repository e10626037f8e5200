// A file in memory as a stream.
#pragma once

#include <cstddef>
#include <ios>
#include <streambuf>
#include <string>

namespace tagrid {

/// The bytes of a file, which is mapped, not read. A position outside the file is an error.
class MappedBytes final : public std::streambuf {
 public:
  /// Throws WorldError if the file cannot be opened.
  explicit MappedBytes(const std::string& path);
  ~MappedBytes() override;
  MappedBytes(const MappedBytes&) = delete;
  MappedBytes& operator=(const MappedBytes&) = delete;

 private:
  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode) override;
  pos_type seekpos(pos_type position, std::ios::openmode) override;

  void* bytes_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace tagrid
