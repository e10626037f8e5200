#include "io/errors/errors.h"

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
#ifdef EDQUOT  // Windows has no quotas of this kind
    case EDQUOT:
#endif
      return "; free some space or choose another directory";
    case EMFILE:
    case ENFILE:
      return "; raise the limit on open files (ulimit -n)";
    case ENXIO:
      return "; it is a socket, or a device that does not exist; give a file or a pipe";
    case EFBIG:
      return "; raise the limit on the size of files (ulimit -f), or choose another file system";
    case EBUSY:
      return "; another program is using it, or it is a mount point";
    case ENAMETOOLONG:
      return "; choose a shorter name";
    default:
      return "";
  }
}

constexpr std::uint64_t mebibyte = std::uint64_t{1} << 20;

std::uint64_t mebibytes(std::uint64_t bytes) { return (bytes + mebibyte - 1) / mebibyte; }

// A limit is suggested only if it reduces the memory.
MemoryNeeds helpful(MemoryNeeds needs) {
  const auto helps = [&](std::uint64_t bytes) { return mebibytes(bytes) < mebibytes(needs.needed); };
  if (needs.with_spool && !helps(*needs.with_spool)) needs.with_spool.reset();
  if (needs.smaller_brick && !helps(needs.smaller_brick->needed)) needs.smaller_brick.reset();
  return needs;
}

std::string limit_in_words(std::uint64_t bytes) {
  return bytes < mebibyte ? fmt::format("{} B", bytes) : fmt::format("{} MiB", bytes / mebibyte);
}

}  // namespace

void blame_sandbox_for_permissions() { is_confined = true; }

WorldError world_error(std::string_view what, std::string_view path, int error_number) {
  return WorldError(fmt::format("{}: {}: {}{}", path, what, std::generic_category().message(error_number),
                                advice(error_number)));
}

std::string option_of(const Setting& setting) { return fmt::format("--{}", setting.name); }

Error::Error(const Sentence& message, ErrorDetail detail) : runtime_error(message.text) {
  if (message.with_options) detail.with_options = message.with_options;
  detail_ = std::make_shared<const ErrorDetail>(std::move(detail));
}

MemoryLimit::MemoryLimit(const std::string& work, const MemoryNeeds& needs)
    : UsageError(Sentence("{} needs at least {} MiB of memory, but the limit is {}", work,
                          mebibytes(needs.needed), limit_in_words(needs.allowed)),
                 {.problem = Problem::memory_limit, .subject = work, .memory = helpful(needs)}) {}

MemoryLimit MemoryLimit::but_for(std::uint64_t bytes) const {
  const auto less = [bytes](std::uint64_t number) { return number - std::min(number, bytes); };
  MemoryNeeds all = {.needed = less(needs().needed), .allowed = less(needs().allowed)};
  if (needs().with_spool) all.with_spool = less(*needs().with_spool);
  return {detail().subject, all};
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
