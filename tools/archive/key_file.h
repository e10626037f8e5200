// The file of --keys: what an archive without names must not say. It is outside of the archive. It has a secret key,
// with which volumes are named, and for every record of the archive the half that names its original.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "io/files/byte_source.h"
#include "tools/archive/record_line.h"

namespace tagrid {

/// True if the line of a record refers to a key file.
bool is_sealed(std::string_view line);

/// The file has lines of JSON: first {"event": "key", "secret": ...}, then halves of records: {"keyed": DIGITS,
/// "output": ..., "input": ..., "patient": ...}. The last half of an output is the newest. Several runs may add to it.
/// Two threads may use it: one that encodes, and one that takes the records of other ranks.
class KeyFile {
 public:
  /// Opens the file. If it does not exist and this `creates` it, only its owner may read it. Throws WorldError, and
  /// UsageError if it is not a key file.
  explicit KeyFile(const std::string& path, bool creates = false);

  const std::string& path() const { return path_; }
  /// Throws WorldError if no halves can be added.
  void require_writable() const;
  /// True if others than its owner may read it.
  bool is_open_to_others() const;

  /// HMAC-SHA-256 of texts, none of which has a zero byte: the first `digits` of 64 hexadecimal ones.
  std::string hash(std::initializer_list<std::string_view> texts, std::size_t digits) const;

  /// A record without what names its original. That half is in this file when this returns, and durable. Throws
  /// WorldError.
  nlohmann::ordered_json sealed(nlohmann::ordered_json record);
  /// True if the line of an archive says that it was made with this key.
  bool has_sealed(std::string_view line) const;
  /// The whole record for a line of an archive, as text; nothing if this file does not have its half.
  std::optional<std::string> opened(std::string_view line);

  /// Calls use(half) for all halves, the older ones first.
  template <class Use>
  void for_each(Use use) {
    read_more();
    for (const auto& [place, size] : places_)
      if (const auto half = half_at(place, size)) use(*half);
  }

 private:
  void create();
  std::string id() const;
  void read_more();
  void append(const std::string& digits, const nlohmann::ordered_json& half);
  std::optional<nlohmann::ordered_json> half_at(std::uint64_t place, std::size_t size) const;
  std::optional<nlohmann::ordered_json> half_called(const std::string& digits);

  std::string path_, secret_;
  std::mutex mutex_;  ///< held by sealed() and opened()
  LinesRead read_;
  std::shared_ptr<const ByteSource> file_;
  std::map<std::uint64_t, std::size_t> places_;  ///< of halves, with their sizes
  std::map<std::string, std::uint64_t> by_digits_;
};

/// Throws UsageError if a file or directory is, or would be, below the directory of an archive. `option`: --keys
void require_outside(const std::string& option, const std::string& path, const std::string& folder);

}  // namespace tagrid
