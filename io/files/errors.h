// What can go wrong outside of the program, as exceptions. Each kind has an exit code of its own.
//
// what() is a sentence that makes sense to any caller. It names no option of the command line: an error carries
// a code and values, and tools/report/advice.h makes words for people of them.
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// What went wrong, where a layer above may know what to do about it. Everything else is `none`.
enum class Problem : std::uint8_t {
  none,
  output_exists,
  memory_limit,           ///< a MemoryLimit
  no_known_format,        ///< the file may be samples without a header
  compressed_file,        ///< of gzip or the like
  nifti_header,           ///< a NIfTI volume of two files
  nifti_file,             ///< a NIfTI volume of one file
  meta_image_header,      ///< a MetaImage volume
  not_openvdb,            ///< a grid was asked for, and the file has none
  openvdb_described,      ///< an OpenVDB file says itself how its samples lie
  endian_differs,         ///< from that of the NRRD header
  spacing_differs,        ///< from that of the NRRD header
  spacing_not_in_header,  ///< the NRRD header has none
  several_grids,          ///< an OpenVDB file has several, and none was chosen
  mesh_fills_no_space,    ///< the volume is a slice
};

/// Something that a caller decides on: by the name that the layers above know it by ("max-error"), and in words
/// ("the largest error").
struct Setting {
  std::string_view name, words;
};

/// A value in a sentence: text, a number, or a setting.
struct Term {
  Term() = default;
  Term(std::string value) : text(std::move(value)) {}
  Term(std::string_view value) : text(value) {}
  Term(const char* value) : text(value) {}
  Term(std::integral auto value) : text(std::to_string(value)) {}
  Term(double value);
  Term(const Setting& value) : text(value.words), setting(value.name) {}

  bool operator==(const Term&) const = default;

  std::string text;
  std::string setting;  ///< name of the setting; "" where it is none
};

/// A sentence with {} for each of its terms.
struct Sentence {
  std::string text;
  std::vector<Term> terms;

  bool operator==(const Sentence&) const = default;
};

/// The sentence with its terms; settings are in words, or called `prefix` and their name where there is a prefix.
std::string text_of(const Sentence& sentence, std::string_view prefix = "");

/// What an error says besides its message.
struct ErrorDetail {
  Problem problem = Problem::none;
  std::string context;                 ///< what() begins with it: where it was thrown ("rank 1: ")
  Sentence sentence;                   ///< what follows; without text where what() says it all
  std::vector<std::uint64_t> numbers;  ///< as the problem defines them

  bool operator==(const ErrorDetail&) const = default;
};

class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message, Problem problem = Problem::none)
      : Error(message, ErrorDetail{problem, "", {}, {}}) {}
  explicit Error(const Sentence& sentence, Problem problem = Problem::none)
      : Error(text_of(sentence), ErrorDetail{problem, "", sentence, {}}) {}
  Error(const std::string& message, ErrorDetail detail)
      : runtime_error(message), detail_(std::make_shared<const ErrorDetail>(std::move(detail))) {}

  const ErrorDetail& detail() const { return *detail_; }

 private:
  std::shared_ptr<const ErrorDetail> detail_;  // to copy an exception must not throw
};

/// The bytes that were given are wrong: not a volume, damaged, too short, too long. Exit code 65.
class BrokenInput : public Error {
 public:
  using Error::Error;
};

/// The world failed: a missing file or folder, a permission, a full disk, a read or write error. Exit
/// code 74.
class WorldError : public Error {
 public:
  using Error::Error;
};

/// Whoever read our output is gone. Nobody needs to be told; exit code 74.
class ClosedPipe : public WorldError {
 public:
  using WorldError::WorldError;
};

/// The command is wrong, e.g. its output exists already. Exit code 64.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// Work that does not fit into the memory that is allowed.
class MemoryLimit : public UsageError {
 public:
  /// `work` says what needs memory: "encoding 512 x 512 x 300 int16".
  MemoryLimit(const std::string& work, std::uint64_t allowed, std::uint64_t needed,
              std::optional<std::uint64_t> needed_with_spool);
  /// The same again. REQUIRES: the detail of a MemoryLimit.
  MemoryLimit(const std::string& message, const ErrorDetail& detail) : UsageError(message, detail) {}

  /// The same as a caller sees it who does not count `bytes` that all numbers have in common.
  MemoryLimit but_for(std::uint64_t bytes) const;

  /// The smallest limit that can be kept, and the smallest one where samples may go through a temporary file,
  /// if that helps.
  std::uint64_t needed() const { return detail().numbers[0]; }
  std::optional<std::uint64_t> needed_with_spool() const {
    return detail().numbers.size() > 2 ? std::optional(detail().numbers[2]) : std::nullopt;
  }
};

/// A WorldError that says where (`path`), what failed ("cannot open"), why (`error_number`, an errno) and,
/// where that is known, what to do.
WorldError world_error(std::string_view what, std::string_view path, int error_number);

}  // namespace tagrid
