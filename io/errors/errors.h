// Exceptions for errors outside the program. Each kind has its own exit code.
//
// what() is a sentence that makes sense to any caller. It names no option of the command line: an error
// carries a code and values, from which tools/report/failure.h makes words for people.
#pragma once

#include <concepts>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// The errors for which a layer above may know what to do. All others are `none`.
enum class Problem : std::uint8_t {
  none,
  output_exists,
  memory_limit,         ///< a MemoryLimit
  writer_memory,        ///< the program that writes the output needs more memory than the limit: both numbers
  no_known_format,      ///< the file may be samples without a header
  compressed_file,      ///< compressed by gzip or a similar program
  not_openvdb,          ///< a grid was requested, but the file is not OpenVDB
  describes_itself,     ///< the layout of samples was given, but the file has a header
  endian_differs,       ///< the byte order differs from that in the NRRD header
  mesh_fills_no_space,  ///< the volume is a slice
  no_source_files,      ///< a .tag file has no envelope
  slices_missing,       ///< by the numbers in the names of files, slices are missing
  data_outside,         ///< a header names a file outside its directory
  program_memory,       ///< a program for a format lacks memory, or may lack it; a larger limit gives it more
  cancelled,            ///< a caller of the library asked to stop
  newer_format,         ///< the file is not damaged, but of a newer version of the format
  unknown_beginning,    ///< the file begins neither like a .tag file nor like any volume that is known
};

/// A setting of a caller: its name ("max-error") and its description ("the largest error").
struct Setting {
  std::string_view name, words;
};

/// A value in a sentence: a text, a number, or a setting.
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
  std::string setting;  ///< name of the setting; "" if there is none
};

/// A sentence that contains {} for each of its terms.
struct Sentence {
  std::string text;
  std::vector<Term> terms;

  bool operator==(const Sentence&) const = default;
};

/// The sentence with its terms. Settings appear as descriptions or, with a prefix, as `prefix` and name.
std::string text_of(const Sentence& sentence, std::string_view prefix = "");

/// One of several things of which the user must choose one.
struct Choice {
  std::string name, text;

  bool operator==(const Choice&) const = default;
};

/// The content of an error besides its message.
struct ErrorDetail {
  Problem problem = Problem::none;
  std::string context;                 ///< the beginning of what(): where it was thrown ("rank 1: ")
  Sentence sentence;                   ///< the rest of what(); empty if what() has no terms
  std::vector<std::uint64_t> numbers;  ///< their meaning depends on the problem
  std::vector<Choice> choices = {};    ///< what can be chosen from

  bool operator==(const ErrorDetail&) const = default;
};

class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message, Problem problem = Problem::none)
      : Error(message, ErrorDetail{problem, "", {}, {}}) {}
  explicit Error(const Sentence& sentence, Problem problem = Problem::none)
      : Error(text_of(sentence), ErrorDetail{problem, "", sentence, {}}) {}
  /// The same, with what can be chosen from.
  Error(const Sentence& sentence, std::vector<Choice> choices)
      : Error(text_of(sentence), ErrorDetail{Problem::none, "", sentence, {}, std::move(choices)}) {}
  Error(const std::string& message, ErrorDetail detail)
      : runtime_error(message), detail_(std::make_shared<const ErrorDetail>(std::move(detail))) {}

  const ErrorDetail& detail() const { return *detail_; }

 private:
  std::shared_ptr<const ErrorDetail> detail_;  // shared, as copying an exception must not throw
};

/// The given bytes are wrong: not a volume, damaged, too short, or too long. Exit code 65.
class BrokenInput : public Error {
 public:
  using Error::Error;
};

inline bool is_newer_format(const Error& error) { return error.detail().problem == Problem::newer_format; }

/// The system failed: a missing file, a permission, a full disk, a read or write error. Exit code 74.
class WorldError : public Error {
 public:
  using Error::Error;
};

/// The reader closed the pipe. No message is needed; exit code 74.
class ClosedPipe : public WorldError {
 public:
  using WorldError::WorldError;
};

/// The command makes no sense, e.g. its output already exists. Exit code 64.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// Throws UsageError with this message, a Sentence or plain text, unless the condition holds.
template <class Message = Sentence>
void require(bool condition, const Message& otherwise) {
  if (!condition) throw UsageError(otherwise);
}

/// A smaller edge of bricks, in root cubes, and the limit on memory that is enough with it.
struct SmallerBrick {
  int edge = 0;
  std::uint64_t needed = 0;
};

/// The numbers of a MemoryLimit, by their places in its detail: limits, and the edge of a brick. Those after
/// the second one are 0 if they do not help.
enum MemoryNumber : std::uint8_t {
  needed_limit,
  allowed_limit,
  limit_with_spool,
  smaller_brick,
  limit_with_brick
};

/// The work does not fit into the allowed memory.
class MemoryLimit : public UsageError {
 public:
  /// `work` is what needs the memory: "encoding 512 x 512 x 300 int16".
  MemoryLimit(const std::string& work, std::uint64_t allowed, std::uint64_t needed,
              std::optional<std::uint64_t> needed_with_spool, std::optional<SmallerBrick> brick = {});
  /// Restores such an error. REQUIRES: the detail of a MemoryLimit.
  MemoryLimit(const std::string& message, const ErrorDetail& detail) : UsageError(message, detail) {}

  /// The same error for a caller that does not count `bytes`, which are part of all its numbers.
  MemoryLimit but_for(std::uint64_t bytes) const;

  /// The smallest possible limit; and that with samples in a temporary file, if it is smaller.
  std::uint64_t needed() const { return detail().numbers[needed_limit]; }
  std::optional<std::uint64_t> needed_with_spool() const {
    const std::uint64_t limit = detail().numbers[limit_with_spool];
    return limit > 0 ? std::optional(limit) : std::nullopt;
  }
};

/// Says where (`path`), what failed ("cannot open"), why (`error_number`, an errno) and, if known, what to
/// do.
WorldError world_error(std::string_view what, std::string_view path, int error_number);

/// For a process that confines itself: from now on, world_error() names the sandbox as a possible
/// reason for a missing permission.
void blame_sandbox_for_permissions();

/// What an exception means to the person who started the program.
enum class ErrorKind : std::uint8_t {
  usage,         ///< UsageError
  broken_input,  ///< BrokenInput
  closed_pipe,   ///< ClosedPipe
  world,         ///< WorldError, and system errors of the standard library
  memory,        ///< there is too little memory, or a size is beyond all memory
  bug            ///< anything else
};

struct SortedError {
  ErrorKind kind = ErrorKind::bug;
  std::string message;  ///< what() of the exception
  ErrorDetail detail{};

  bool operator==(const SortedError&) const = default;
};

/// Nothing else sorts exceptions. REQUIRES: `exception` is not null.
SortedError sorted_error(const std::exception_ptr& exception);

/// Throws an exception of that kind with that message and detail; for `memory`, without them.
[[noreturn]] void throw_sorted(const SortedError& error);

}  // namespace tagrid
