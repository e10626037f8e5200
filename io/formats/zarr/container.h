// Where the files of a Zarr hierarchy are written: into a directory, or into a zip file (.ozx, RFC-9 of
// OME-NGFF).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// Files that are written one after the other. All functions throw WorldError.
class ZarrContainer {
 public:
  virtual ~ZarrContainer() = default;

  /// Begins the file with this key, "0/c/1/0/0". REQUIRES: the one before it has ended.
  virtual void begin(const std::string& key) = 0;
  virtual void write(std::span<const std::byte> bytes) = 0;
  virtual void end() = 0;
  void add(const std::string& key, std::string_view text) {
    begin(key);
    write(std::as_bytes(std::span(text.data(), text.size())));
    end();
  }

  /// As those of VolumeSink.
  virtual void publish() = 0;
  virtual void keep() = 0;
  virtual std::uint64_t bytes_written() const = 0;
};

/// True for a directory that has the metadata of a Zarr hierarchy.
bool has_zarr_metadata(const std::string& folder);

/// True for a file that begins as the attributes of an N5 container, or of an array in it, do: they state its version,
/// or the dimensions, the type and the blocks.
bool begins_n5(std::string_view beginning);
/// True for a directory that has such attributes, or whose name ends in .n5.
bool is_n5_folder(const std::string& folder);

/// True for a zip file whose first member has metadata of Zarr, as RFC-9 of OME-NGFF recommends.
bool begins_zarr_in_zip(std::string_view beginning);

/// Begins a zip file if `path` ends in .ozx, otherwise a directory. An existing directory is replaced only if
/// it has_zarr_metadata(). Throws UsageError.
std::unique_ptr<ZarrContainer> create_zarr_container(const std::string& path, const SinkOptions& options);

}  // namespace tagrid
