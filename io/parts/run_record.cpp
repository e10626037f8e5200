#include "io/parts/run_record.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

constexpr std::array<std::uint8_t, 8> magic = {'T', 'A', 'G', 'R', 'U', 'N', '3', '\n'};

void text_field(FieldWriter& fields, const std::string& text) {
  fields.put(static_cast<std::uint32_t>(text.size()));
  fields.put_bytes(std::as_bytes(std::span(text)));
}

void text_field(FieldReader& fields, std::string& text) {
  const auto bytes = fields.get_bytes(fields.get<std::uint32_t>());
  text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

template <class T>
void list_field(FieldWriter& fields, const std::vector<T>& list, auto element) {
  fields.put(static_cast<std::uint32_t>(list.size()));
  for (const T& each : list) element(each);
}

template <class T>
void list_field(FieldReader& fields, std::vector<T>& list, auto element) {
  for (auto left = fields.get<std::uint32_t>(); left > 0 && !fields.overrun(); --left)
    element(list.emplace_back());
}

/// The fields of a record, for a FieldWriter or a FieldReader.
void record_fields(auto& fields, auto& record) {
  text_field(fields, record.program);
  list_field(fields, record.settings, [&](auto& setting) {
    text_field(fields, setting.first);
    text_field(fields, setting.second);
  });
  list_field(fields, record.inputs, [&](auto& id) {
    text_field(fields, id.path);
    fields.field(id.size);
    fields.field(id.inode);
    for (auto* time : {&id.modified, &id.modified_ns, &id.changed, &id.changed_ns}) fields.field(*time);
    fields.field(id.ends_checksum);
  });
  list_field(fields, record.header, [&](auto& byte) { fields.field(byte, std::uint8_t{}); });
  text_field(fields, record.error_rule);
  text_field(fields, record.reason_of_bound);
  fields.field(record.result_inode);
  fields.field(record.result_size);
}

std::string local_time(std::int64_t seconds) {
  const auto time = static_cast<std::time_t>(seconds);
  std::tm parts = {};
  if (!to_local_time(time, parts)) return fmt::format("second {}", seconds);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", parts);
}

std::uint64_t checksum_of_ends(const std::string& path, std::uint64_t size) {
  constexpr std::uint64_t part = 1 << 20;
  FileBytes file(path);
  std::vector<std::byte> first(std::min(size, part)), last(std::min(size, part));
  first.resize(file.read(first.data(), first.size()));
  file.seek(size - last.size());
  last.resize(file.read(last.data(), last.size()));
  return checksum_of({first, last});
}

}  // namespace

FileIdentity identity_of(const std::string& path) {
  const auto status = status_of(path);
  if (!status) throw world_error("cannot open", path, ENOENT);
  if (!status->is_file()) throw UsageError(path + ": is not a file that can be read again");
  FileIdentity id;
  // The same file has the same path here, whatever its name in the command and the current folder.
  id.path = text_of(real_path_if_known(path_of(path)));
  id.size = status->size;
  id.inode = status->number;
  id.modified = status->modified.seconds;
  id.modified_ns = status->modified.nanoseconds;
  id.changed = status->changed.seconds;
  id.changed_ns = status->changed.nanoseconds;
  id.ends_checksum = checksum_of_ends(path, id.size);
  return id;
}

std::string change_of(const FileIdentity& was, const FileIdentity& now) {
  if (was.path != now.path) return fmt::format("the input was {}, now {}", was.path, now.path);
  const std::string changed = fmt::format("the input {} has changed since: ", now.path);
  if (was.size != now.size) return changed + fmt::format("it had {} bytes, now {}", was.size, now.size);
  if (was.modified != now.modified || was.modified_ns != now.modified_ns)
    return changed + "modified " + local_time(now.modified);
  if (was.ends_checksum != now.ends_checksum) return changed + "its content differs";
  if (was.inode != now.inode) return changed + "it is another file";
  if (was.changed != now.changed || was.changed_ns != now.changed_ns)
    return changed + "written to, renamed, or given other permissions " + local_time(now.changed);
  return "";
}

std::vector<std::byte> serialize_record(const RunRecord& record) {
  FieldWriter fields;
  fields.put_bytes(std::as_bytes(std::span(magic)));
  record_fields(fields, record);
  fields.put(checksum_of({fields.bytes()}));
  return std::move(fields.bytes());
}

Status parse_record(std::span<const std::byte> bytes, RunRecord& record) {
  if (bytes.size() < magic.size() + 8 ||
      !std::equal(magic.begin(), magic.end(), reinterpret_cast<const std::uint8_t*>(bytes.data())))
    return Status::broken("is not the record of a run of this version");
  if (!checksums_agree(run_id(bytes), checksum_of({bytes.first(bytes.size() - 8)})))
    return Status::broken("is damaged");
  FieldReader fields(bytes.subspan(magic.size(), bytes.size() - magic.size() - 8));
  record = {};
  record_fields(fields, record);
  return fields.complete() ? Status() : Status::broken("is damaged");
}

std::uint64_t run_id(std::span<const std::byte> record_bytes) {
  return load_little_endian<std::uint64_t>(record_bytes.data() + record_bytes.size() - 8);
}

Sentence difference_of(const RunRecord& was, const RunRecord& now) {
  if (was.program != now.program)
    return {"the run was started with {}, and this is {}", was.program, now.program};
  for (const auto& [name, value] : now.settings)
    for (const auto& [other_name, other] : was.settings)
      if (name == other_name && value != other)
        return {"{} was {}, now {}", Setting{name, name}, other, value};
  if (was.inputs.size() != now.inputs.size()) return "the number of input files has changed";
  for (std::size_t i = 0; i < was.inputs.size(); ++i)
    if (std::string change = change_of(was.inputs[i], now.inputs[i]); !change.empty()) return change;
  const bool same = was.settings == now.settings && was.header == now.header;
  return same ? "" : "the settings or the input have changed";
}

}  // namespace tagrid
