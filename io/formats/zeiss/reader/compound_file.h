// Compound files of OLE2, through libgsf: storages, which are like directories, and streams, which are like files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

struct _GsfInfile;
struct _GsfInput;

namespace tagrid {

/// A stream of a compound file.
class CompoundStream {
 public:
  CompoundStream(std::string path, std::shared_ptr<_GsfInput> input)
      : path_(std::move(path)), input_(std::move(input)) {}

  std::uint64_t size() const;
  /// Reads the first bytes. Throws BrokenInput if there are fewer, or if they cannot be found in the file.
  void read(std::span<std::byte> out) const;

 private:
  std::string path_;  ///< of the file, and of the stream in it
  std::shared_ptr<_GsfInput> input_;
};

/// Safe for any bytes. Names are the same in capitals and in small letters.
class CompoundFile {
 public:
  /// Throws BrokenInput if the file is not one, and WorldError if it cannot be opened.
  explicit CompoundFile(const std::string& path);

  /// "ImageInfo/PixelSize": at most one storage, and a stream in it; nothing if there is none.
  std::optional<CompoundStream> find(std::string_view name) const;
  /// The same. Throws BrokenInput if there is none.
  CompoundStream at(std::string_view name) const;
  /// All bytes of a short stream; nothing if there is none. Throws BrokenInput if it has more than `most` bytes.
  std::optional<std::vector<std::byte>> content(std::string_view name, std::size_t most) const;

 private:
  std::string path_;
  std::shared_ptr<_GsfInfile> root_;
  /// The storage in which a stream was last looked for.
  mutable std::string storage_name_;
  mutable std::shared_ptr<_GsfInfile> storage_;
};

}  // namespace tagrid
