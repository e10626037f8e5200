#include "io/formats/zarr/container.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/files/output_file.h"
#include "io/files/output_folder.h"
#include "io/samples/file_sink.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

class FolderContainer final : public ZarrContainer {
 public:
  FolderContainer(const std::string& path, const SinkOptions& options)
      : folder_(path, options.overwrite, options.like, has_zarr_metadata) {}

  void begin(const std::string& key) override { folder_.begin(key); }
  void write(std::span<const std::byte> bytes) override { folder_.write(bytes); }
  void end() override { folder_.end(); }
  void publish() override { folder_.publish(); }
  void keep() override { folder_.keep(); }
  std::uint64_t bytes_written() const override { return folder_.bytes(); }

 private:
  OutputFolder folder_;
};

/// Numbers, one after the other.
void put(FieldWriter& record, auto... numbers) { (record.put(numbers), ...); }

constexpr std::uint16_t version = 45;  // that of sizes of 64 bits
constexpr std::uint16_t names_are_utf8 = 1u << 11;
constexpr std::uint16_t first_of_1980 =
    0x21;  // a date that says nothing, so that equal volumes are equal files
constexpr std::uint16_t short_all = 0xffff;
constexpr std::uint32_t in_extra = 0xffffffff;
constexpr std::uint16_t extra_of_sizes = 1;

/// Members are stored as they are, and their sizes have 64 bits: APPNOTE.TXT 6.3.10 of PKWARE, section 4.3.
class ZipContainer final : public ZarrContainer {
 public:
  ZipContainer(const std::string& path, const SinkOptions& options)
      : file_(path, options.overwrite, output_options(options)) {
    if (!file_.can_seek())
      throw UsageError(file_.name() +
                       ": zip files are not written to pipes or devices; give the name of a file");
  }

  void begin(const std::string& key) override {
    member_ = {.key = key, .header = file_.position()};
    file_.write(header());
  }
  void write(std::span<const std::byte> bytes) override {
    file_.write(bytes);
    member_.size += bytes.size();
    member_.crc = static_cast<std::uint32_t>(
        crc32_z(member_.crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  }
  void end() override {
    file_.write_at(member_.header, header());
    add_to_table();
  }
  void publish() override {
    end_of_table();
    file_.publish();
  }
  void keep() override { file_.keep(); }
  std::uint64_t bytes_written() const override { return file_.position(); }

 private:
  struct Member {
    std::string key;
    std::uint64_t header = 0, size = 0;
    std::uint32_t crc = 0;
  };

  /// What the header of a member and its entry in the table have in common, after the version that made it.
  void add_facts(FieldWriter& record) const {
    put(record, version, names_are_utf8, std::uint16_t{0}, std::uint16_t{0}, first_of_1980);
    put(record, member_.crc, in_extra, in_extra, static_cast<std::uint16_t>(member_.key.size()));
  }
  std::vector<std::byte> header() const {
    FieldWriter record;
    put(record, std::uint32_t{0x04034b50});
    add_facts(record);
    put(record, std::uint16_t{4 + 16});
    record.put_bytes(std::as_bytes(std::span(member_.key)));
    put(record, extra_of_sizes, std::uint16_t{16}, member_.size, member_.size);
    return std::move(record.bytes());
  }
  void add_to_table() {
    constexpr std::uint16_t made_on_unix = 3u << 8u | version;
    put(table_, std::uint32_t{0x02014b50}, made_on_unix);
    add_facts(table_);
    put(table_, std::uint16_t{4 + 24}, std::uint16_t{0}, std::uint16_t{0}, std::uint16_t{0});
    put(table_, std::uint32_t{0100644u << 16u}, in_extra);
    table_.put_bytes(std::as_bytes(std::span(member_.key)));
    put(table_, extra_of_sizes, std::uint16_t{24}, member_.size, member_.size, member_.header);
    ++members_;
  }
  void end_of_table() {
    const std::uint64_t begin = file_.position(), size = table_.bytes().size(), end = begin + size;
    using namespace std::string_view_literals;
    constexpr std::string_view comment = "{\"ome\": {\"version\": \"0.5\"}}\0"sv;
    put(table_, std::uint32_t{0x06064b50}, std::uint64_t{44}, version, version);
    put(table_, std::uint32_t{0}, std::uint32_t{0}, members_, members_, size, begin);
    put(table_, std::uint32_t{0x07064b50}, std::uint32_t{0}, end, std::uint32_t{1});
    put(table_, std::uint32_t{0x06054b50}, std::uint16_t{0}, std::uint16_t{0}, short_all, short_all);
    put(table_, in_extra, in_extra, static_cast<std::uint16_t>(comment.size()));
    table_.put_bytes(std::as_bytes(std::span(comment)));
    file_.write(table_.bytes());
  }

  OutputFile file_;
  Member member_;
  FieldWriter table_;
  std::uint64_t members_ = 0;
};

}  // namespace

bool has_zarr_metadata(const std::string& folder) {
  return std::ranges::any_of(std::array{"/zarr.json", "/.zgroup", "/.zarray"},
                             [&](const char* name) { return is_file(folder + name); });
}

namespace {

/// True if a key in a beginning of JSON has a value that begins with this character.
bool has_member(std::string_view json, std::string_view key, char first_of_value) {
  constexpr std::string_view blanks = " \t\r\n";
  for (std::size_t at = 0; (at = json.find(key, at)) != json.npos;) {
    at += key.size();
    const std::size_t colon = json.find_first_not_of(blanks, at);
    if (colon == json.npos || json[colon] != ':') continue;
    const std::size_t value = json.find_first_not_of(blanks, colon + 1);
    if (value != json.npos && json[value] == first_of_value) return true;
  }
  return false;
}

/// True for the attributes of a container, or of an array.
bool are_of_n5(const nlohmann::json& attributes) {
  if (!attributes.is_object()) return false;
  const auto stated = attributes.find("n5");
  return (stated != attributes.end() && stated->is_string()) ||
         (attributes.contains("dimensions") && attributes.contains("blockSize") &&
          attributes.contains("dataType"));
}

}  // namespace

bool begins_n5(std::string_view b) {
  return b.starts_with('{') && (has_member(b, "\"n5\"", '"') ||
                                (has_member(b, "\"dimensions\"", '[') &&
                                 has_member(b, "\"blockSize\"", '[') && has_member(b, "\"dataType\"", '"')));
}

bool is_n5_folder(const std::string& folder) {
  constexpr std::size_t most = std::size_t{1} << 20;
  const std::string path = folder.substr(0, folder.find_last_not_of('/') + 1),
                    attributes = path + "/attributes.json";
  if (lower_case(path).ends_with(".n5")) return true;
  if (!is_file(attributes)) return false;
  std::string text(most, '\0');
  text.resize(FileBytes(attributes).read(reinterpret_cast<std::byte*>(text.data()), text.size()));
  // Other programs have files of this name. What is nested deeper says nothing here.
  const auto json = nlohmann::json::parse(
      text.begin(), text.end(), [](int depth, auto, auto&) { return depth < 2; }, false);
  return json.is_discarded() ? begins_n5(text) : are_of_n5(json);
}

bool begins_zarr_in_zip(std::string_view b) {
  constexpr std::size_t name_at = 30, size_at = 26;
  if (!b.starts_with("PK\x03\x04") || b.size() < name_at) return false;
  const std::size_t size =
      static_cast<unsigned char>(b[size_at]) + 256u * static_cast<unsigned char>(b[size_at + 1]);
  const std::string_view path = b.substr(name_at, size), name = path.substr(path.rfind('/') + 1);
  return name == "zarr.json" || name == ".zgroup" || name == ".zarray" || name == ".zattrs";
}

std::unique_ptr<ZarrContainer> create_zarr_container(const std::string& path, const SinkOptions& options) {
  if (path == "-")
    throw UsageError(
        "Zarr is not written to the standard output; give the name of a directory, or of a file (.ozx)");
  if (lower_case(path).ends_with(".ozx")) return std::make_unique<ZipContainer>(path, options);
  return std::make_unique<FolderContainer>(path, options);
}

}  // namespace tagrid
