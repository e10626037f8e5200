#include "io/errors/errors.h"

#include <fmt/args.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <stdexcept>
#include <system_error>

namespace tagrid {
namespace {

bool is_confined = false;  // set before the process starts threads

std::string_view advice(int error_number) {
  switch (error_number) {
    case ENOENT:
    case ENOTDIR:
      return "; check the name, and that its directory exists";
    case EACCES:
    case EPERM:
      if (is_confined)
        return "; check the permissions of the file and its directory; if they are right, the sandbox of the "
               "reader blocks it (TAGRID_SANDBOX=off allows it)";
      return "; check the permissions of the file and its directory";
    case EROFS:
      return "; choose another directory, or make this one writable";
    case ENOSPC:
    case EDQUOT:
      return "; free some space or choose another directory";
    case EMFILE:
    case ENFILE:
      return "; raise the limit on open files (ulimit -n)";
    case ENXIO:
      return "; it is a socket, or a device that does not exist; give a file or a pipe";
    case EFBIG:
      return "; raise the limit on the size of files (ulimit -f), or choose another file system";
    case ENAMETOOLONG:
      return "; choose a shorter name";
    default:
      return "";
  }
}

constexpr std::uint64_t mebibyte = std::uint64_t{1} << 20;

std::uint64_t mebibytes(std::uint64_t bytes) { return (bytes + mebibyte - 1) / mebibyte; }

Sentence sentence_of(const std::string& work, std::uint64_t allowed, std::uint64_t needed) {
  const std::string limit =
      allowed < mebibyte ? fmt::format("{} B", allowed) : fmt::format("{} MiB", allowed / mebibyte);
  return {"{} needs at least {} MiB of memory, but the limit is {}", {work, mebibytes(needed), limit}};
}

ErrorDetail detail_of(const std::string& work, std::uint64_t allowed, std::uint64_t needed,
                      std::optional<std::uint64_t> needed_with_spool,
                      const std::optional<SmallerBrick>& brick) {
  ErrorDetail detail{
      Problem::memory_limit, "", sentence_of(work, allowed, needed), {needed, allowed, 0, 0, 0}};
  // A setting is suggested only if it reduces the memory.
  const auto helps = [&](std::uint64_t bytes) { return mebibytes(bytes) < mebibytes(needed); };
  if (needed_with_spool && helps(*needed_with_spool)) detail.numbers[limit_with_spool] = *needed_with_spool;
  if (brick && helps(brick->needed)) {
    detail.numbers[smaller_brick] = static_cast<std::uint64_t>(brick->edge);
    detail.numbers[limit_with_brick] = brick->needed;
  }
  return detail;
}

}  // namespace

void blame_sandbox_for_permissions() { is_confined = true; }

WorldError world_error(std::string_view what, std::string_view path, int error_number) {
  return WorldError(fmt::format("{}: {}: {}{}", path, what, std::generic_category().message(error_number),
                                advice(error_number)));
}

Term::Term(double value) : text(fmt::format("{}", value)) {}

std::string text_of(const Sentence& sentence, std::string_view prefix) {
  fmt::dynamic_format_arg_store<fmt::format_context> terms;
  for (const Term& term : sentence.terms)
    terms.push_back(prefix.empty() || term.setting.empty() ? term.text
                                                           : fmt::format("{}{}", prefix, term.setting));
  return fmt::vformat(sentence.text, terms);
}

MemoryLimit::MemoryLimit(const std::string& work, std::uint64_t allowed, std::uint64_t needed,
                         std::optional<std::uint64_t> needed_with_spool, std::optional<SmallerBrick> brick)
    : MemoryLimit(text_of(sentence_of(work, allowed, needed)),
                  detail_of(work, allowed, needed, needed_with_spool, brick)) {}

MemoryLimit MemoryLimit::but_for(std::uint64_t bytes) const {
  const auto less = [bytes](std::uint64_t number) { return number - std::min(number, bytes); };
  std::optional<std::uint64_t> with_spool = needed_with_spool();
  if (with_spool) with_spool = less(*with_spool);
  return {detail().sentence.terms.at(0).text, less(detail().numbers.at(allowed_limit)), less(needed()),
          with_spool};
}

SortedError sorted_error(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const UsageError& error) {
    return {ErrorKind::usage, error.what(), error.detail()};
  } catch (const BrokenInput& error) {
    return {ErrorKind::broken_input, error.what(), error.detail()};
  } catch (const ClosedPipe& error) {
    return {ErrorKind::closed_pipe, error.what(), error.detail()};
  } catch (const WorldError& error) {
    return {ErrorKind::world, error.what(), error.detail()};
  } catch (const std::bad_alloc& error) {
    return {ErrorKind::memory, error.what(), {}};
  } catch (const std::length_error& error) {
    // A container was asked for more elements than any memory holds.
    return {ErrorKind::memory, error.what(), {}};
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again)
      return {ErrorKind::world,
              "the system cannot create more threads; raise its limit on processes (ulimit -u) or on address "
              "space (ulimit -v)",
              {}};
    return {ErrorKind::world, error.what(), {}};
  } catch (const std::exception& error) {
    return {ErrorKind::bug, error.what(), {}};
  } catch (...) {
    return {ErrorKind::bug, "an exception of an unknown type was thrown", {}};
  }
}

void throw_sorted(const SortedError& error) {
  switch (error.kind) {
    case ErrorKind::usage:
      if (error.detail.problem == Problem::memory_limit) throw MemoryLimit(error.message, error.detail);
      throw UsageError(error.message, error.detail);
    case ErrorKind::broken_input:
      throw BrokenInput(error.message, error.detail);
    case ErrorKind::closed_pipe:
      throw ClosedPipe(error.message, error.detail);
    case ErrorKind::world:
      throw WorldError(error.message, error.detail);
    case ErrorKind::memory:
      throw std::bad_alloc();
    case ErrorKind::bug:
      break;
  }
  throw std::runtime_error(error.message);
}

}  // namespace tagrid
