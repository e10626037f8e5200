#include "io/formats/zarr/reader/array.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/formats/zarr/reader/json.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::size_t most_axes = 32;
/// Bytes of a piece: more than programs write, and what Blosc can have.
constexpr std::uint64_t most_piece = (std::uint64_t{1} << 31) - 1;

/// Reads the metadata of one array.
class Reading {
 public:
  Reading(const ZarrStore& store, const ZarrNode& node)
      : name_(joined(store.path(), node.metadata_key)), json_(node.metadata) {
    array_.path = node.path;
    array_.attributes = node.attributes;
    array_.is_n5 = node.is_n5();
    if (node.is_n5())
      read_n5();
    else if (node.is_version_2())
      read_version_2();
    else
      read_version_3();
    read_names();
    check();
  }

  ZarrArray take() { return std::move(array_); }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw BrokenInput("{}: {}: {}", name_, array_.format(), why);
  }
  const Json& required(const Json& object, const char* key) const {
    const Json& value = member(object, key);
    if (value.is_null()) refuse(fmt::format("has no {}", key));
    return value;
  }

  std::vector<std::int64_t> sizes(const Json& object, const char* key, std::int64_t least) const {
    const Json& list = required(object, key);
    std::vector<std::int64_t> sizes;
    if (!list.is_array() || list.size() > most_axes) refuse(fmt::format("its {} is {}", key, shown(list)));
    for (const Json& size : list) {
      constexpr std::uint64_t most = std::uint64_t{1} << 62;
      if (!size.is_number_unsigned() || size.get<std::uint64_t>() > most || size.get<std::int64_t>() < least)
        refuse(fmt::format("its {} is {}", key, shown(list)));
      sizes.push_back(size.get<std::int64_t>());
    }
    return sizes;
  }

  /// Axes come in the order of the array here, the slowest one first.
  void read_n5() {
    array_.shape = sizes(json_, "dimensions", 0);
    array_.chunk = sizes(json_, "blockSize", 1);
    std::ranges::reverse(array_.shape);
    std::ranges::reverse(array_.chunk);
    array_.piece = array_.chunk;
    const Json& type = required(json_, "dataType");
    array_.type_name = type.is_string() ? printable(type.get<std::string>()) : shown(type);
    array_.type = sample_type_named(array_.type_name);
    array_.big_endian = true;
    array_.order.resize(array_.shape.size());
    std::iota(array_.order.begin(), array_.order.end(), std::size_t{0});
    const Json& compression = member(json_, "compression");
    // Version 1 had a name instead of an object.
    const std::string name =
        compression.is_null() ? text_at(json_, "compressionType") : text_at(compression, "type");
    if (name.empty()) refuse(fmt::format("its compression is {}", shown(compression)));
    if (name != "raw") add_codec(name);
    if (array_.type) array_.fill.assign(size_of(*array_.type), std::byte{0});
    const Json& names = member(array_.attributes, "axes");
    if (!names.is_array() || names.size() != array_.shape.size()) return;
    for (const Json& axis : names)
      array_.axis_names.insert(array_.axis_names.begin(), axis.is_string() ? axis.get<std::string>() : "");
  }

  void read_version_2() {
    if (member(json_, "zarr_format") != 2) refuse("is not of Zarr version 2");
    array_.shape = sizes(json_, "shape", 0);
    array_.chunk = array_.piece = sizes(json_, "chunks", 1);
    read_type_of_version_2(required(json_, "dtype"));
    const std::string order = text_at(json_, "order");
    if (order != "C" && order != "F") refuse(fmt::format("its order is {}", tagrid::quoted(order)));
    array_.order.resize(array_.shape.size());
    std::iota(array_.order.begin(), array_.order.end(), std::size_t{0});
    if (order == "F") std::ranges::reverse(array_.order);
    if (const Json& filters = member(json_, "filters"); !filters.is_null() && !filters.empty())
      refuse(fmt::format("has filters, which are not supported: {}", shown(filters)));
    if (const Json& compressor = member(json_, "compressor"); !compressor.is_null())
      add_codec(text_at(compressor, "id"));
    const Json& separator = member(json_, "dimension_separator");
    set_separator(separator.is_null() ? Json(".") : separator);
    read_fill(member(json_, "fill_value"));
  }

  void read_type_of_version_2(const Json& type) {
    if (!type.is_string()) refuse(fmt::format("samples of the type {} are not supported", shown(type)));
    const std::string text = type.get<std::string>();
    array_.type_name = tagrid::quoted(text);
    if (text.size() < 3 || std::string_view("<>|").find(text[0]) == std::string_view::npos) return;
    array_.big_endian = text[0] == '>';
    const auto size = whole_number_of(text.substr(2)).value_or(0);
    if (text[1] == 'u' || text[1] == 'i') array_.type_name = (text[1] == 'u' ? "uint" : "int");
    if (text[1] == 'f') array_.type_name = "float";
    if (array_.type_name != tagrid::quoted(text))
      array_.type_name += fmt::format("{}", 8 * std::min<std::int64_t>(size, 64));
    if (text[1] == 'b') array_.type_name = "bool";
    array_.type = sample_type_named(array_.type_name);
  }

  void read_version_3() {
    static constexpr std::string_view known[] = {
        "zarr_format",         "node_type",  "shape",  "data_type",  "chunk_grid",
        "chunk_key_encoding",  "fill_value", "codecs", "attributes", "dimension_names",
        "storage_transformers"};
    for (const auto& [key, value] : json_.items())
      if (std::ranges::find(known, key) == std::end(known) && !value.is_null() &&
          member(value, "must_understand") != false)
        refuse(fmt::format("has the key {}, which is not supported", tagrid::quoted(key)));
    if (const Json& transformers = member(json_, "storage_transformers");
        !transformers.is_null() && !transformers.empty())
      refuse(fmt::format("has storage transformers, which are not supported: {}", shown(transformers)));
    array_.shape = sizes(json_, "shape", 0);
    const Json& type = required(json_, "data_type");
    array_.type_name = type.is_string() ? printable(type.get<std::string>()) : shown(type);
    array_.type = sample_type_named(array_.type_name);
    const Json& grid = required(json_, "chunk_grid");
    if (text_at(grid, "name") != "regular")
      refuse(fmt::format("its chunk grid is {}; only regular ones are supported", shown(grid)));
    array_.chunk = array_.piece = sizes(required(grid, "configuration"), "chunk_shape", 1);
    read_keys(required(json_, "chunk_key_encoding"));
    array_.order.resize(array_.shape.size());
    std::iota(array_.order.begin(), array_.order.end(), std::size_t{0});
    read_codecs(required(json_, "codecs"), false);
    read_fill(required(json_, "fill_value"));
  }

  /// In version 2, only xarray gives axes names.
  void read_names() {
    const Json& own = member(json_, "dimension_names");
    const Json& names = own.is_null() ? member(array_.attributes, "_ARRAY_DIMENSIONS") : own;
    if (!names.is_array()) return;
    for (const Json& name : names)
      array_.axis_names.push_back(name.is_string() ? name.get<std::string>() : "");
  }

  void read_keys(const Json& encoding) {
    const std::string name = text_at(encoding, "name");
    if (name != "default" && name != "v2")
      refuse(fmt::format("its chunk key encoding is {}, which is not supported", shown(encoding)));
    if (name == "default") array_.first_of_keys = "c";
    const Json& separator = member(member(encoding, "configuration"), "separator");
    set_separator(!separator.is_null() ? separator : Json(name == "default" ? "/" : "."));
  }

  void set_separator(const Json& separator) {
    if (separator != "/" && separator != ".")
      refuse(fmt::format("the separator of its keys is {}", shown(separator)));
    array_.separator = separator.get<std::string>().front();
  }

  /// Codecs of version 3, in the order of compression: of an array, then from an array to bytes, then of
  /// bytes.
  void read_codecs(const Json& codecs, bool in_shards) {
    if (!codecs.is_array() || codecs.size() > most_axes)
      refuse(fmt::format("its codecs are {}", shown(codecs)));
    bool is_bytes = false;
    for (const Json& codec : codecs) {
      const std::string name = codec.is_string() ? codec.get<std::string>() : text_at(codec, "name");
      const Json& configuration = member(codec, "configuration");
      if (name == "transpose" && !is_bytes) {
        transpose(member(configuration, "order"));
      } else if (name == "bytes" && !is_bytes) {
        is_bytes = true;
        set_endian(configuration, array_.big_endian);
      } else if (name == "sharding_indexed" && !is_bytes) {
        if (in_shards || codecs.size() > 1)
          refuse("shards within shards, or with other codecs around them, are not supported");
        return read_shards(configuration);
      } else if (is_bytes) {
        add_codec(name);
      } else {
        refuse(fmt::format("its codec {} is not supported", shown(codec)));
      }
    }
    if (!is_bytes) refuse(fmt::format("none of its codecs makes bytes: {}", shown(codecs)));
  }

  void set_endian(const Json& configuration, bool& is_big) const {
    const Json& endian = member(configuration, "endian");
    if (!endian.is_null() && endian != "little" && endian != "big")
      refuse(fmt::format("its endian is {}", shown(endian)));
    is_big = endian == "big";
  }

  void transpose(const Json& order) {
    const std::size_t axes = array_.shape.size();
    std::vector<std::size_t> next;
    if (order == "F")
      for (std::size_t i = axes; i-- > 0;) next.push_back(i);
    else if (order == "C")
      for (std::size_t i = 0; i < axes; ++i) next.push_back(i);
    else if (order.is_array())
      for (const Json& axis : order)
        if (axis.is_number_unsigned() && axis.get<std::uint64_t>() < axes)
          next.push_back(axis.get<std::size_t>());
    std::vector<std::size_t> sorted = next;
    std::ranges::sort(sorted);
    if (next.size() != axes || std::ranges::adjacent_find(sorted) != sorted.end())
      refuse(fmt::format("the order of its codec transpose is {}", shown(order)));
    for (std::size_t& axis : next) axis = array_.order[axis];
    array_.order = std::move(next);
  }

  void read_shards(const Json& configuration) {
    if (!std::ranges::is_sorted(array_.order)) refuse("shards of transposed arrays are not supported");
    array_.piece = sizes(configuration, "chunk_shape", 1);
    ZarrShards shards;
    if (const Json& location = member(configuration, "index_location"); !location.is_null()) {
      if (location != "start" && location != "end")
        refuse(fmt::format("the index of its shards is at {}", shown(location)));
      shards.index_is_last = location == "end";
    }
    bool is_bytes = false;
    for (const Json& codec : required(configuration, "index_codecs")) {
      const std::string name = codec.is_string() ? codec.get<std::string>() : text_at(codec, "name");
      if (name == "bytes" && !is_bytes) {
        is_bytes = true;
        set_endian(member(codec, "configuration"), shards.index_is_big_endian);
      } else if (name == "crc32c" && is_bytes && !shards.index_has_crc) {
        shards.index_has_crc = true;
      } else {
        refuse(fmt::format("the codec {} of the index of its shards is not supported", shown(codec)));
      }
    }
    if (!is_bytes) refuse("none of the codecs of the index of its shards makes bytes");
    array_.shards = shards;
    read_codecs(required(configuration, "codecs"), true);
  }

  void add_codec(const std::string& name) {
    if (name == "crc32c") return array_.codecs.push_back(ZarrCodec::crc32c);
    const auto compressor = name == "blosc"                    ? ZarrCodec::blosc
                            : name == "zstd"                   ? ZarrCodec::zstd
                            : name == "gzip" || name == "zlib" ? ZarrCodec::zlib
                                                               : ZarrCodec::crc32c;
    if (compressor == ZarrCodec::crc32c)
      refuse(fmt::format("its codec {} is not supported; blosc, zstd, gzip, zlib and crc32c are",
                         tagrid::quoted(name)));
    if (std::ranges::any_of(array_.codecs, [](ZarrCodec one) { return one != ZarrCodec::crc32c; }))
      refuse("several compressors one after the other are not supported");
    array_.codecs.push_back(compressor);
  }

  void read_fill(const Json& fill) {
    if (!array_.type) return;
    array_.fill.assign(size_of(*array_.type), std::byte{0});
    array_.has_fill = !fill.is_null();
    if (!array_.has_fill) return;
    with_sample_type(*array_.type, [&]<class T>(T) {
      if (const auto value = fill_value<T>(fill))
        store_little_endian(array_.fill.data(), *value);
      else
        refuse(fmt::format("its fill value is {}, which is no {}", shown(fill), array_.type_name));
    });
  }

  template <class T>
  static std::optional<T> fill_value(const Json& fill) {
    if constexpr (std::is_floating_point_v<T>) {
      if (fill.is_number()) return static_cast<T>(fill.get<double>());
      if (fill == "NaN") return std::numeric_limits<T>::quiet_NaN();
      if (fill == "Infinity") return std::numeric_limits<T>::infinity();
      if (fill == "-Infinity") return -std::numeric_limits<T>::infinity();
      return fill.is_string() ? bits_of<T>(fill.get<std::string>()) : std::nullopt;
    } else {
      const auto fits = [](auto value) -> std::optional<T> {
        return std::in_range<T>(value) ? std::optional(static_cast<T>(value)) : std::nullopt;
      };
      if (fill.is_number_unsigned()) return fits(fill.get<std::uint64_t>());
      if (fill.is_number_integer()) return fits(fill.get<std::int64_t>());
      if (!fill.is_number_float()) return std::nullopt;
      const double number = fill.get<double>();  // 0.0, as some programs have it
      constexpr double most = 9e15;
      if (std::abs(number) > most || number != std::floor(number)) return std::nullopt;
      return fits(static_cast<std::int64_t>(number));
    }
  }

  /// "0x7fc00000": the bits of a float, the highest ones first.
  template <class T>
  static std::optional<T> bits_of(const std::string& text) {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    Bits bits = 0;
    const char* end = text.data() + text.size();
    if (text.size() != 2 + 2 * sizeof(T) || !text.starts_with("0x")) return std::nullopt;
    const auto result = std::from_chars(text.data() + 2, end, bits, 16);
    if (result.ec != std::errc() || result.ptr != end) return std::nullopt;
    T value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

  void check() const {
    const std::size_t axes = array_.shape.size();
    if (array_.chunk.size() != axes || array_.piece.size() != axes ||
        (!array_.axis_names.empty() && array_.axis_names.size() != axes))
      refuse("its shape, its chunks and its names are not of one number of axes");
    for (std::size_t axis = 0; axis < axes; ++axis)
      if (array_.chunk[axis] % array_.piece[axis] != 0)
        refuse(fmt::format("shards of {} are not divided by chunks of {}", fmt::join(array_.chunk, " x "),
                           fmt::join(array_.piece, " x ")));
    if (array_.type && array_.piece_bytes() > most_piece)
      refuse(fmt::format("its chunks of {} samples are too large", fmt::join(array_.piece, " x ")));
  }

  std::string name_;
  const Json& json_;
  ZarrArray array_;
};

}  // namespace

std::uint64_t ZarrArray::piece_bytes() const {
  std::uint64_t bytes = size_of(*type);
  for (const std::int64_t size : piece)
    if (__builtin_mul_overflow(bytes, static_cast<std::uint64_t>(size), &bytes))
      return std::numeric_limits<std::uint64_t>::max();
  return bytes;
}

std::string ZarrArray::key(const std::vector<std::int64_t>& numbers) const {
  std::string name = first_of_keys;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!name.empty()) name += separator;
    name += std::to_string(numbers[is_n5 ? numbers.size() - 1 - i : i]);
  }
  return joined(path, name);
}

namespace {

/// Containers of another major version may have other blocks.
void require_known_version(const std::string& name, const Json& attributes) {
  constexpr int most = 4;
  const Json& stated = member(attributes, "n5");
  if (!stated.is_string()) return;
  const std::string version = stated.get<std::string>(), major = version.substr(0, version.find('.'));
  if (major.size() == 1 && major[0] >= '1' && major[0] <= '0' + most) return;
  throw broken_zarr(
      name,
      fmt::format("is of the version {}, which is not supported; 1 to {} are", tagrid::quoted(version), most),
      "N5");
}

/// N5 has one file for all attributes, also those that make an array.
std::optional<ZarrNode> n5_node(const ZarrStore& store, const std::string& path) {
  ZarrNode node;
  node.path = path;
  node.metadata_key = joined(path, "attributes.json");
  auto json = json_at(store, node.metadata_key);
  if (!json) return std::nullopt;
  node.metadata = std::move(*json);
  require_known_version(joined(store.path(), node.metadata_key), node.metadata);
  node.is_array = node.metadata.contains("dimensions") && node.metadata.contains("dataType");
  node.attributes = node.metadata;
  for (const char* own : {"n5", "dimensions", "blockSize", "dataType", "compression", "compressionType"})
    node.attributes.erase(own);
  return node;
}

}  // namespace

std::optional<ZarrNode> zarr_node(const ZarrStore& store, const std::string& path) {
  if (!path.empty() && !is_safe_name(path)) return std::nullopt;
  ZarrNode node;
  node.path = path;
  node.metadata_key = joined(path, "zarr.json");
  if (auto json = json_at(store, node.metadata_key)) {
    node.metadata = std::move(*json);
    const std::string type = text_at(node.metadata, "node_type");
    if (member(node.metadata, "zarr_format") != 3 || (type != "array" && type != "group"))
      throw broken_zarr(joined(store.path(), node.metadata_key), "is not of Zarr version 3");
    node.is_array = type == "array";
    node.attributes = member(node.metadata, "attributes");
  } else {
    for (const bool is_array : {true, false}) {
      node.metadata_key = joined(path, is_array ? ".zarray" : ".zgroup");
      auto other = json_at(store, node.metadata_key);
      if (!other) continue;
      node.is_array = is_array;
      node.metadata = std::move(*other);
      node.attributes = json_at(store, joined(path, ".zattrs")).value_or(Json());
      break;
    }
    // Some programs copy the description of levels alone.
    if (node.metadata.is_null()) {
      node.metadata_key = joined(path, ".zattrs");
      auto attributes = json_at(store, node.metadata_key);
      if (!attributes) return n5_node(store, path);
      node.metadata = Json::object();
      node.attributes = std::move(*attributes);
    }
  }
  if (!node.attributes.is_object()) node.attributes = Json::object();
  return node;
}

ZarrArray zarr_array(const ZarrStore& store, const ZarrNode& node) { return Reading(store, node).take(); }

}  // namespace tagrid
