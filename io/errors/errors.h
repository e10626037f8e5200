// Exceptions for errors outside the program. Each kind has its own exit code.
//
// what() is a sentence that makes sense to any caller. It names no option of the command line: an error
// carries a code and values, from which tools/report/failure.h makes words for people.
#pragma once

#include <fmt/core.h>

#include <concepts>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
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
  volumes_below,        ///< a directory is not a volume, but volumes may be in it
  unknown_beginning,    ///< the file begins neither like a .tag file nor like any volume that is known
};

/// A setting of a caller: its name ("max-error") and its description ("the largest error").
struct Setting {
  std::string_view name, words;
};

/// The option of the command line for a setting: "--max-error".
std::string option_of(const Setting& setting);

struct Sentence;
/// How a value of a sentence is checked against its {}.
template <class Value>
using Shown =
    std::conditional_t<std::same_as<Value, Setting> || std::same_as<Value, Sentence>, std::string, Value>;

/// A message for callers of the library, and the same for users of the command line.
struct Sentence {
  Sentence() = default;
  Sentence(std::string words) : text(std::move(words)) {}
  Sentence(const char* words) : text(words) {}
  /// As fmt::format(), but a Setting appears as its description, or as the option of the command line.
  template <class First, class... Others>
  Sentence(fmt::format_string<Shown<First>, Shown<Others>...> form, const First& first,
           const Others&... others)
      : text(fmt::format(fmt::runtime(form), in_words(first), in_words(others)...)) {
    if constexpr (names_settings<First> || (names_settings<Others> || ...))
      with_options = fmt::format(fmt::runtime(form), as_option(first), as_option(others)...);
  }

  bool operator==(const Sentence&) const = default;

  std::string text;
  std::optional<std::string> with_options = {};  ///< if it names settings

 private:
  template <class Value>
  static constexpr bool names_settings = !std::same_as<Value, Shown<Value>>;

  static std::string_view in_words(const Setting& setting) { return setting.words; }
  static const std::string& in_words(const Sentence& part) { return part.text; }
  static std::string as_option(const Setting& setting) { return option_of(setting); }
  static std::string as_option(const Sentence& part) { return part.with_options.value_or(part.text); }
  template <class Value>
  static const Value& in_words(const Value& value) {
    return value;
  }
  template <class Value>
  static const Value& as_option(const Value& value) {
    return value;
  }
};

/// One of several things of which the user must choose one.
struct Choice {
  std::string name, text;

  bool operator==(const Choice&) const = default;
};

/// A smaller edge of bricks, in root cubes, and the limit on memory that is enough with it.
struct SmallerBrick {
  int edge = 0;
  std::uint64_t needed = 0;

  bool operator==(const SmallerBrick&) const = default;
};

/// Limits on memory, in bytes.
struct MemoryNeeds {
  std::uint64_t needed = 0;                        ///< the smallest possible limit
  std::uint64_t allowed = 0;                       ///< the limit that there is
  std::optional<std::uint64_t> with_spool = {};    ///< with samples in a temporary file, if that needs less
  std::optional<SmallerBrick> smaller_brick = {};  ///< if that needs less

  bool operator==(const MemoryNeeds&) const = default;
};

/// The content of an error besides its message.
struct ErrorDetail {
  Problem problem = Problem::none;
  std::string subject = {};                      ///< the file or the work that the error is about, if known
  std::optional<std::string> with_options = {};  ///< the message, if it names settings
  std::optional<MemoryNeeds> memory = {};        ///< of memory_limit and writer_memory
  std::string option = {};                       ///< the setting that chooses one of the choices: "series"
  std::vector<Choice> choices = {};              ///< what can be chosen from

  bool operator==(const ErrorDetail&) const = default;
};

class Error : public std::runtime_error {
 public:
  explicit Error(const Sentence& message, Problem problem = Problem::none)
      : Error(message, ErrorDetail{.problem = problem}) {}
  Error(const Sentence& message, ErrorDetail detail);
  /// The message is a Sentence of these values.
  template <class First, class... Others>
  requires(!std::same_as<First, Problem> && !std::same_as<First, ErrorDetail>)
      Error(fmt::format_string<Shown<First>, Shown<Others>...> form, const First& first,
            const Others&... others)
      : Error(Sentence(form, first, others...)) {}

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

/// The work does not fit into the allowed memory.
class MemoryLimit : public UsageError {
 public:
  /// `work` is what needs the memory: "encoding 512 x 512 x 300 int16".
  MemoryLimit(const std::string& work, const MemoryNeeds& needs);
  /// Restores such an error. REQUIRES: the detail of a MemoryLimit.
  MemoryLimit(const std::string& message, const ErrorDetail& detail) : UsageError(message, detail) {}

  /// The same error for a caller that does not count `bytes`, which are part of all its numbers.
  MemoryLimit but_for(std::uint64_t bytes) const;

  const MemoryNeeds& needs() const { return detail().memory.value(); }
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
