// The metadata of Zarr arrays, versions 2 and 3, and of N5: https://zarr-specs.readthedocs.io
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/formats/zarr/reader/codecs.h"
#include "io/formats/zarr/reader/store.h"
#include "io/programs/answers.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// How a chunk is divided into pieces, which are compressed one by one: sharding_indexed.
struct ZarrShards {
  bool index_is_last = true, index_has_crc = false, index_is_big_endian = false;
};

struct ZarrArray {
  bool is_n5 = false;                ///< Keys have the fastest axis first, and each file has a header.
  std::string path;                  ///< in the store; "" for its root
  std::vector<std::int64_t> shape;   ///< the slowest axis first, here and below
  std::vector<std::int64_t> chunk;   ///< of a file
  std::vector<std::int64_t> piece;   ///< of what is compressed: a chunk, or one of a shard
  std::optional<ZarrShards> shards;  ///< if a chunk has several pieces
  std::string type_name;             ///< as the file has it
  std::optional<SampleType> type;    ///< nothing if tagrid has no such type
  bool big_endian = false;
  std::vector<std::size_t> order;  ///< axis i of the samples in a piece is order[i] of the array
  std::vector<ZarrCodec> codecs;   ///< of the bytes of a piece
  std::string first_of_keys;       ///< "c", or "" in version 2
  char separator = '/';
  std::vector<std::byte> fill;          ///< a sample, little endian
  bool has_fill = true;                 ///< false if the file does not say which one
  std::vector<std::string> axis_names;  ///< "" for one without; may be empty
  Json attributes = Json::object();

  /// "Zarr" or "N5", for messages.
  std::string_view format() const { return is_n5 ? "N5" : "Zarr"; }
  std::uint64_t piece_bytes() const;
  /// The key of the chunk with these numbers along each axis.
  std::string key(const std::vector<std::int64_t>& numbers) const;
};

/// What is at a path of a store.
struct ZarrNode {
  std::string path;
  bool is_array = false;
  std::string metadata_key;   ///< of the file that says so
  Json metadata, attributes;  ///< the attributes are an object

  bool is_n5() const { return metadata_key.ends_with("attributes.json"); }
  /// A word of ours for files of which it is true.
  bool is_version_2() const { return !metadata_key.ends_with("zarr.json") && !is_n5(); }
};

/// The group or array at a path, if there is one; also a group of version 2 that has nothing but attributes.
/// Throws BrokenInput if its metadata is not JSON.
std::optional<ZarrNode> zarr_node(const ZarrStore& store, const std::string& path);

/// The array. Throws BrokenInput if anything in its metadata is not understood that may change samples, but
/// for types that tagrid has not.
ZarrArray zarr_array(const ZarrStore& store, const ZarrNode& node);

}  // namespace tagrid
