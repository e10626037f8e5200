#include "tools/archive/key_file.h"

#include <fmt/format.h>
#include <sodium.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <span>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/files/held_files.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/archive/subject.h"
#include "tools/report/damage.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t digits_of_half = 32, digits_of_secret = 64;
constexpr std::size_t digits_of_id = 8;
constexpr const char* half_key = "keyed";
constexpr const char* mark_of_key = "key";  // of a record in the archive: by which key file it is

/// What a record says of its original, besides `input`, its files, and the subject.
struct PrivateKey {
  const char* name;
  ordered_json instead;  ///< in the archive
};

/// "error" is not null in the archive if there is one: whether a line failed is no secret.
const std::array<PrivateKey, 5>& private_keys() {
  static const std::array<PrivateKey, 5> keys = {{{"options", ordered_json::object()},
                                                  {"error", nullptr},
                                                  {"lossy_source", nullptr},
                                                  {"warnings", ordered_json::array()},
                                                  {"why_not_restorable", nullptr}}};
  return keys;
}

bool are_digits(std::string_view text, std::size_t count) {
  return text.size() == count && text.find_first_not_of("0123456789abcdef") == text.npos;
}

std::string in_digits(std::span<const unsigned char> bytes) {
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

/// The digits in "keyed:DIGITS"; "" for another text.
std::string digits_in(const ordered_json& text) {
  if (!text.is_string()) return "";
  const auto& name = text.get_ref<const std::string&>();
  const auto digits = std::string_view(name).substr(std::min(name.size(), keyed_mark.size()));
  return name.starts_with(keyed_mark) && are_digits(digits, digits_of_half) ? std::string(digits) : "";
}

/// The text that a member of an object has; "" if it has another type, or is not there.
std::string text_in(const ordered_json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}

/// True if there is a complete line, or more than a line of a key would need.
bool has_line(const std::string& path) {
  constexpr std::size_t most = 4096;
  const auto status = status_of(path);
  if (!status || !status->is_file() || status->size == 0) return false;
  FileBytes file(path);
  const std::string_view beginning = file.peek(most);
  return beginning.size() == most || beginning.find('\n') != beginning.npos;
}

ordered_json names_of_files(const ordered_json& record) {
  ordered_json names = ordered_json::array();
  const auto files = record.find("input_files");
  if (files != record.end() && files->is_array())
    for (const ordered_json& file : *files) names.push_back({{"path", file.at("path")}});
  return names;
}

}  // namespace

bool is_sealed(std::string_view line) {
  return line.find(fmt::format("\"input\":\"{}", keyed_mark)) != line.npos;
}

void require_outside(const std::string& option, const std::string& path, const std::string& folder) {
  if (is_below(real_path(path_of(path)), real_path(path_of(folder))))
    throw UsageError("{} {}: is inside of {}, which must not have its names; choose a file elsewhere", option,
                     path, folder);
}

KeyFile::KeyFile(const std::string& path, bool creates) : path_(path) {
  if (const auto name = status_of_name(path_); name && name->is_link())
    throw UsageError(path_ + ": is a link; give the key file itself (--keys)");
  if (creates) create();
  const auto status = status_of(path_);
  if (!status) throw world_error("cannot open", path_, ENOENT);
  if (!status->is_file()) throw UsageError(path_ + ": is not a file; give a key file (--keys)");
  read_more();
  if (secret_.empty())
    throw UsageError(path_ + ": is not a key file: its first line has no key; give another file (--keys)");
}

bool KeyFile::is_open_to_others() const {
  const auto status = status_of(path_);
  return status && (status->mode & 077) != 0;
}

/// A run that was killed here leaves an empty file or half a line, in whose place the next one makes a key.
void KeyFile::create() {
  if (has_line(path_)) return;
  const OutputLock lock(path_);
  if (const auto status = status_of(path_); status && (status->mode & 077) != 0 && !has_line(path_))
    throw UsageError(path_ + ": has no key yet, and others can open it; remove it, or chmod 600 " +
                     word_of_command(path_));
  {
    const Descriptor file = files().open(path_, {.write = true, .creates = true, .mode = 0600});
    if (file < 0) throw world_error("cannot create", path_, errno);
  }
  if (has_line(path_)) return;  // another run was first
  LineFile lines(path_);
  std::array<unsigned char, digits_of_secret / 2> bytes = {};
  if (!fill_with_random(bytes)) throw world_error("cannot make a key for", path_, errno);
  lines.append(written_json({{"event", "key"}, {"secret", in_digits(bytes)}}));
}

void KeyFile::read_more() {
  const std::uint64_t before = read_.bytes;
  NewLines lines(path_, read_);
  if (read_.bytes < before) {  // another file
    places_.clear();
    by_digits_.clear();
  }
  for (std::string line; lines.next(line);) {
    const ordered_json json = ordered_json::parse(line, nullptr, false);
    if (!json.is_object()) continue;
    if (secret_.empty() && text_in(json, "event") == "key") {
      if (const auto text = text_in(json, "secret"); are_digits(text, digits_of_secret)) secret_ = text;
    } else if (!text_in(json, half_key).empty()) {
      const std::uint64_t place = read_.bytes - line.size();
      places_[place] = line.size();
      by_digits_[json[half_key].get<std::string>()] = place;
    }
  }
  if (read_.bytes != before || !file_) file_ = std::make_shared<FileSource>(path_);
}

std::string KeyFile::hash(std::initializer_list<std::string_view> texts, std::size_t digits) const {
  crypto_auth_hmacsha256_state state;
  const auto bytes = [](std::string_view text) { return reinterpret_cast<const std::uint8_t*>(text.data()); };
  crypto_auth_hmacsha256_init(&state, bytes(secret_), secret_.size());
  for (const std::string_view text : texts) {
    crypto_auth_hmacsha256_update(&state, bytes(text), text.size());
    crypto_auth_hmacsha256_update(&state, bytes(std::string_view("\0", 1)), 1);  // which ends each text
  }
  std::array<std::uint8_t, crypto_auth_hmacsha256_BYTES> digest = {};
  crypto_auth_hmacsha256_final(&state, digest.data());
  return in_digits(digest).substr(0, digits);
}

std::optional<ordered_json> KeyFile::half_at(std::uint64_t place, std::size_t size) const {
  std::string line(size, '\0');
  if (place + size > file_->size()) return std::nullopt;
  file_->read_at(place, std::as_writable_bytes(std::span(line)));
  ordered_json half = ordered_json::parse(line, nullptr, false);
  return half.is_object() && !text_in(half, "output").empty() && !text_in(half, "input").empty()
             ? std::optional(std::move(half))
             : std::nullopt;
}

std::optional<ordered_json> KeyFile::half_called(const std::string& digits) {
  // A half is there before its record is.
  if (!by_digits_.contains(digits)) read_more();
  const auto found = by_digits_.find(digits);
  return found == by_digits_.end() ? std::nullopt : half_at(found->second, places_.at(found->second));
}

void KeyFile::require_writable() const {
  try {
    const OutputLock lock(path_);
    LineFile lines(path_);
  } catch (const WorldError& error) {
    throw WorldError(fmt::format(
        "{}: convert adds the names of every volume to the key file, and cannot ({}); make the file and its "
        "directory writable",
        path_, error.what()));
  }
}

void KeyFile::append(const std::string& digits, const ordered_json& half) {
  const OutputLock lock(path_);
  LineFile lines(path_);
  ordered_json line = {{half_key, digits}};
  line.update(half);
  lines.append(written_json(line));
}

ordered_json KeyFile::sealed(ordered_json record) {
  const std::lock_guard lock(mutex_);
  ordered_json half = {{"output", record.at("output")}, {"input", record.at("input")}};
  if (const auto subject = record.find(subject_key); subject != record.end()) {
    half.update(*subject);
    record.erase(subject);
  }
  for (const PrivateKey& key : private_keys())
    if (const auto found = record.find(key.name); found != record.end()) half[key.name] = *found;
  half["input_files"] = names_of_files(record);
  const std::string digits = hash({"record", written_json(half)}, digits_of_half),
                    name = std::string(keyed_mark) + digits;
  if (!by_digits_.contains(digits)) read_more();
  if (!by_digits_.contains(digits)) append(digits, half);
  record["input"] = name;
  record[mark_of_key] = id();
  for (const PrivateKey& key : private_keys())
    if (const auto found = record.find(key.name); found != record.end())
      *found = key.name == std::string_view("error") && !found->is_null() ? ordered_json(name) : key.instead;
  if (const auto files = record.find("input_files"); files != record.end() && files->is_array())
    for (std::size_t i = 0; i < files->size(); ++i) (*files)[i]["path"] = fmt::format("{}/{}", name, i);
  return record;
}

std::string KeyFile::id() const { return hash({"key"}, digits_of_id); }

bool KeyFile::has_sealed(std::string_view line) const {
  const ordered_json record = ordered_json::parse(line, nullptr, false);
  return record.is_object() && text_in(record, mark_of_key) == id();
}

std::optional<std::string> KeyFile::opened(std::string_view line) {
  ordered_json record = ordered_json::parse(line, nullptr, false);
  if (!record.is_object()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const std::string digits = digits_in(record.value("input", ordered_json()));
  const auto half = digits.empty() ? std::nullopt : half_called(digits);
  if (!half) return std::nullopt;
  record["input"] = half->at("input");
  for (const PrivateKey& key : private_keys())
    if (const auto found = half->find(key.name); found != half->end()) record[key.name] = *found;
  if (const auto files = record.find("input_files"); files != record.end() && files->is_array()) {
    const auto names = half->find("input_files");
    if (names == half->end() || !names->is_array() || names->size() != files->size()) return std::nullopt;
    for (std::size_t i = 0; i < files->size(); ++i) {
      const std::string path = (*names)[i].is_object() ? text_in((*names)[i], "path") : "";
      if (path.empty() || !(*files)[i].is_object()) return std::nullopt;
      (*files)[i]["path"] = path;
    }
  }
  ordered_json subject = ordered_json::object();
  for (const char* key : keys_of_subjects)
    if (const auto found = half->find(key); found != half->end()) subject[key] = *found;
  record[subject_key] = std::move(subject);
  return written_json(record);
}

}  // namespace tagrid
